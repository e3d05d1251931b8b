"""The answer of a decode, and all it rests on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mtm_audit.decoding.frames import Delivered
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.start import Start
from mtm_audit.detectors.base import Reading
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.reference_frame import ReferenceFrame
from mtm_audit.model.track import Floats
from mtm_audit.significance.evidence import Evidence
from mtm_onboard.protocol.framing import Payload
from mtm_onboard.protocol.scheme import Channel, Scheme

VerdictName = Literal["decoded", "absent", "inconclusive"]
# What became of a channel: read; seen, but nothing of its waveform in the motion; shown by no track; seen too briefly.
ChannelState = Literal["read", "silent", "unseen", "too short"]
# By the paper's detector a symbol is certain when its posterior probability is at least this.
CERTAIN = 0.95


@dataclass(frozen=True, kw_only=True)
class ChannelDecoding:
    """What one channel's motion said; `glimpse` and `reading` are None when no track shows its body.

    `posteriors` (positions, M): probability of each symbol at each of the channel's positions, given that a message
    is there. `searched` when the track was found by search, not by name, number or choice; `exchanged` when names said
    another one. `nats`: the channel's log e-value by itself, None where the detector gives none. `refusal` says why a
    track could not be read, `also_shows` which channel of another body its motion plays.
    """

    channel: Channel
    glimpse: Glimpse | None
    reading: Reading | None
    posteriors: Floats
    searched: bool = False
    exchanged: bool = False
    state: ChannelState = "read"
    nats: float | None = None
    refusal: str | None = None
    also_shows: str | None = None

    @property
    def onset_s(self) -> float | None:
        """First instant in the recording at which the message starts; repeats of it start later."""
        if self.reading is None:
            return None
        starts_s = self.reading.window_starts_s[self.reading.window_positions == 0]
        return float(starts_s[0]) if len(starts_s) else self.reading.timing.onset_s


@dataclass(frozen=True, kw_only=True)
class Decoding:
    """`symbols` has one entry a message position (None where nothing shows it), `posteriors` (L, M) the probabilities
    behind them; those of a framed message are in frame order, and before the code has corrected any. `symbol_nats` are
    log e-values of the symbols, None where the detector gives none, and `needed_nats` what each must reach. `message`
    is the number they spell, or the frame's payload, given only with the verdict "decoded". `order_known` is False when
    the message repeats and nothing shows which of its symbols comes first. `frames` are the framed messages found, in
    the order in which they were sent, `message` being the last; a single one that does not hold is the best guess.
    `leaps` counts by track name the leaps that were taken out. `frame` is the one along whose axes motion was read,
    and `piece` (begin, end) the part of a long recording that was, None for all of it. `together` are the decodings of
    each recording where several were put together; the channels are then those of the one that shows most.
    """

    verdict: VerdictName
    message: Payload | None
    symbols: tuple[int | None, ...]
    posteriors: Floats
    symbol_nats: tuple[float | None, ...]
    needed_nats: float
    order_known: bool
    evidence: Evidence
    channels: tuple[ChannelDecoding, ...]
    start: Start
    frames: tuple[Delivered, ...]
    key_id: str
    scheme: Scheme
    settings: DecodeSettings
    leaps: Mapping[str, int] = field(default_factory=dict)
    frame: ReferenceFrame = "world"
    piece: tuple[float, float] | None = None
    together: tuple["Decoding", ...] = ()

    @property
    def uncertain(self) -> tuple[int, ...]:
        """Message positions whose symbol is missing or does not meet its bound."""
        return tuple(place for place in range(len(self.symbols)) if not self._is_sure(place))

    def _is_sure(self, place: int) -> bool:
        symbol, nats = self.symbols[place], self.symbol_nats[place]
        if symbol is None:
            return False
        if self.evidence.nats is None or self.scheme.framing is not None:
            return bool(self.posteriors[place, symbol] >= CERTAIN)
        return nats is not None and nats >= self.needed_nats
