"""From tracks to a verdict: assignment, readings under the key and its decoys, symbols or frames, message."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import softmax

from mtm_audit.decoding.assignment import assign_tracks
from mtm_audit.decoding.frames import Delivered, Heard, decode_frames
from mtm_audit.decoding.order import order_is_known
from mtm_audit.decoding.readings import Progress, Readings, read_tracks
from mtm_audit.decoding.start import Start, start_of
from mtm_audit.detectors import make_detector
from mtm_audit.detectors.base import Reading
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats, Track
from mtm_audit.significance.decoys import Evidence, VerdictName
from mtm_onboard.protocol.framing import Payload, number_of_symbols
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Channel, Scheme

# A symbol is certain when its posterior probability is at least this.
CERTAIN = 0.95


# A recording without a message has a p-value below this once in a hundred.
NEARLY = 0.01
MORE_DECOYS = 5


@dataclass(frozen=True)
class DecodeSettings:
    """How to decode: `onset_s` None searches for the message's start; `assignment` maps bodies to track names.

    `profile` is what is known of the robots' plant beforehand; the detector must take one. `at` is when the recording
    was made, which a rolling schedule needs.
    """

    detector: str = "matched"
    onset_s: float | None = None
    decoys: int = 40
    threshold: float = 1e-4
    assignment: Mapping[str, str] = field(default_factory=dict)
    profile: PlantProfile | None = None
    at: RecordedAt | None = None


@dataclass(frozen=True)
class ChannelDecoding:
    """What one channel's motion said; `glimpse` and `reading` are None when no track shows its body.

    `posteriors` (positions, M): probability of each symbol at each of the channel's positions, given that a message
    is there. `searched` when the track was found by search, not by name, number or choice.
    """

    channel: Channel
    glimpse: Glimpse | None
    reading: Reading | None
    posteriors: Floats
    searched: bool = False

    @property
    def onset_s(self) -> float | None:
        """First instant in the recording at which the message starts; repeats of it start later."""
        if self.reading is None:
            return None
        starts_s = self.reading.window_starts_s[self.reading.window_positions == 0]
        return float(starts_s[0]) if len(starts_s) else self.reading.timing.onset_s


@dataclass(frozen=True)
class Decoding:
    """The answer, and all it rests on.

    `symbols` has one entry a message position (None where nothing shows it), `posteriors` (L, M) the probabilities
    behind them; those of a framed message are in frame order, and before the code has corrected any. `message` is the
    number they spell, or the frame's payload, given only with the verdict "decoded". `order_known` is False when the
    message repeats and nothing shows which of its symbols comes first. `frames` are the framed messages found, in the
    order in which they were sent, `message` being the last; a single one that does not hold is the best guess.
    """

    verdict: VerdictName
    message: Payload | None
    symbols: tuple[int | None, ...]
    posteriors: Floats
    order_known: bool
    evidence: Evidence
    channels: tuple[ChannelDecoding, ...]
    start: Start
    frames: tuple[Delivered, ...]
    key_id: str
    scheme: Scheme
    settings: DecodeSettings

    @property
    def evidence_bits(self) -> float:
        """The evidence of all channels together, see `Evidence.bits`."""
        return self.evidence.bits(sum(decoding.reading is not None for decoding in self.channels))

    @property
    def uncertain(self) -> tuple[int, ...]:
        """Message positions whose symbol is missing or less than `CERTAIN`."""
        return tuple(
            place
            for place, symbol in enumerate(self.symbols)
            if symbol is None or self.posteriors[place, symbol] < CERTAIN
        )


def decode_tracks(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Progress | None = None
) -> Decoding:
    """Decode a message from tracks under a key.

    Evidence that lies near the limit is judged anew by five times as many decoys, since a tail known from few of them
    is taken for heavy. `progress(stage, fraction)` is called now and then. Raises MtmError when no channel can be read
    at all.
    """
    decoding = _decoded(tracks, key, settings, progress)
    if not settings.threshold < decoding.evidence.p_value <= NEARLY:
        return decoding
    return _decoded(tracks, key, replace(settings, decoys=MORE_DECOYS * settings.decoys), progress)


def _decoded(tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Progress | None) -> Decoding:
    detector = make_detector(settings.detector, settings.profile)
    assignment = assign_tracks(key.scheme, tracks, settings.assignment)
    start = start_of(key.scheme, tracks, settings.onset_s, settings.at)
    readings = read_tracks(assignment, key, detector, settings.decoys, start, progress)
    channels = tuple(_channel_decoding(channel, readings, key.scheme) for channel in key.scheme.channels)
    order_known = settings.onset_s is not None or all(
        order_is_known(decoding.reading, decoding.channel, key.scheme.schedule)
        for decoding in channels
        if decoding.reading is not None
    )
    frames: tuple[Delivered, ...] = ()
    posteriors, symbols = _message_symbols(key.scheme, channels)
    present = readings.evidence.p_value <= settings.threshold
    # A frame read from a recording without a message would be chance, and a check of few bits would let some pass.
    if key.scheme.framing is not None and present:
        frames = decode_frames(
            _heard(readings, key.scheme), key.scheme, key.secret, start.first_slot, order_known=order_known
        )
        posteriors, symbols = _frame_symbols(frames[-1])
    undecided = Decoding(
        "inconclusive" if present else "absent",
        None,
        symbols,
        posteriors,
        order_known,
        readings.evidence,
        channels,
        start,
        frames,
        key.id,
        key.scheme,
        settings,
    )
    message = _message_of(undecided) if present else None
    return undecided if message is None else replace(undecided, verdict="decoded", message=message)


def _message_of(decoding: Decoding) -> Payload | None:
    """What a present message says; None when that is uncertain."""
    framing = decoding.scheme.framing
    if framing is not None:
        read = decoding.frames[-1].message
        # Without a check the order of the symbols and the likeliest codeword are all there is.
        sure = read.check_passed or (framing.check == "none" and decoding.order_known and read.posterior >= CERTAIN)
        return read.payload if sure else None
    if decoding.uncertain or not decoding.order_known:
        return None
    return number_of_symbols([symbol for symbol in decoding.symbols if symbol is not None], decoding.scheme)


def _heard(readings: Readings, scheme: Scheme) -> list[Heard]:
    return [
        Heard(channel, readings.channels[channel.name])
        for channel in scheme.channels
        if channel.name in readings.channels
    ]


def _frame_symbols(frame: Delivered) -> tuple[Floats, tuple[int | None, ...]]:
    """Posteriors (L, M) and decisions of a frame's symbols, each by itself."""
    ratios = frame.ratios
    seen = np.ptp(ratios, axis=1) > 0.0
    symbols = tuple(int(best) if known else None for best, known in zip(np.argmax(ratios, axis=1), seen, strict=True))
    return softmax(ratios, axis=1), symbols


def _channel_decoding(channel: Channel, readings: Readings, scheme: Scheme) -> ChannelDecoding:
    glimpse, result = readings.glimpses.get(channel.body), readings.channels.get(channel.name)
    searched = channel.body in readings.searched
    if result is None:
        unknown = np.full((channel.symbols, scheme.alphabet_size), 1.0 / scheme.alphabet_size)
        return ChannelDecoding(channel, glimpse, None, unknown, searched)
    return ChannelDecoding(channel, glimpse, result.reading, result.posteriors, searched)


def _message_symbols(scheme: Scheme, channels: Sequence[ChannelDecoding]) -> tuple[Floats, tuple[int | None, ...]]:
    """Posteriors (L, M) and decisions of the message's positions: joined when split, pooled when the same."""
    if scheme.combine == "split":
        posteriors = np.concatenate([decoding.posteriors for decoding in channels])
        seen = [decoding.reading is not None for decoding in channels for _ in range(decoding.channel.symbols)]
        best = np.argmax(posteriors, axis=1)
        return posteriors, tuple(int(symbol) if known else None for symbol, known in zip(best, seen, strict=True))
    read = [decoding for decoding in channels if decoding.reading is not None]
    logs = np.sum([np.log(np.maximum(decoding.posteriors, 1e-300)) for decoding in read], axis=0)
    return softmax(logs, axis=1), tuple(_pooled(scheme, read))


def _pooled(scheme: Scheme, read: Sequence[ChannelDecoding]) -> list[int]:
    """The paper's pooling of channels that carry the same symbols: mean score, or majority vote (mean breaks ties)."""
    scores = np.mean([decoding.reading.scores for decoding in read if decoding.reading is not None], axis=0)
    if scheme.pooling == "mean":
        return [int(symbol) for symbol in np.argmax(scores, axis=1)]
    votes = np.zeros_like(scores)
    for decoding in read:
        if decoding.reading is not None:
            np.add.at(votes, (np.arange(len(votes)), np.argmax(decoding.reading.scores, axis=1)), 1.0)
    span = np.ptp(scores, axis=1, keepdims=True)
    ranked = votes + 0.5 * (scores - scores.min(axis=1, keepdims=True)) / np.maximum(span, 1e-300)
    return [int(symbol) for symbol in np.argmax(ranked, axis=1)]
