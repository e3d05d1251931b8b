"""From tracks to a verdict: assignment, glimpses, readings under the key and its decoys, symbols, message."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from mtm_audit.assignment import assign_tracks
from mtm_audit.detectors import make_detector
from mtm_audit.detectors.base import ChannelReading, Observation, Reading
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.glimpse import Glimpse, glimpse_of_track
from mtm_audit.order import order_is_known
from mtm_audit.tracks import Floats, Track
from mtm_audit.verdict import Evidence, VerdictName, decoy_codebooks
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing import number_of_symbols
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Channel, Scheme

# A symbol is certain when its posterior probability is at least this.
CERTAIN = 0.95
# The onset search takes about a kilobyte a tick; at 50 Hz this is 2.8 h.
_MOST_TICKS = 500_000


@dataclass(frozen=True)
class DecodeSettings:
    """How to decode: `onset_s` None searches for the message's start; `assignment` maps bodies to track names.

    `profile` is what is known of the robots' plant beforehand; the detector must take one.
    """

    detector: str = "coherency"
    onset_s: float | None = None
    decoys: int = 40
    threshold: float = 1e-4
    assignment: Mapping[str, str] = field(default_factory=dict)
    profile: PlantProfile | None = None


@dataclass(frozen=True)
class ChannelDecoding:
    """What one channel's motion said; `glimpse` and `reading` are None when no track shows its body.

    `posteriors` (positions, M): probability of each symbol at each of the channel's positions, given that a message
    is there.
    """

    channel: Channel
    glimpse: Glimpse | None
    reading: Reading | None
    posteriors: Floats

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
    behind them. `message` is the number they spell, given only with the verdict "decoded". `order_known` is False when
    the message repeats and nothing shows which of its symbols comes first.
    """

    verdict: VerdictName
    message: int | None
    symbols: tuple[int | None, ...]
    posteriors: Floats
    order_known: bool
    evidence: Evidence
    channels: tuple[ChannelDecoding, ...]
    key_id: str
    scheme: Scheme
    settings: DecodeSettings

    @property
    def uncertain(self) -> tuple[int, ...]:
        """Message positions whose symbol is missing or less than `CERTAIN`."""
        return tuple(
            place
            for place, symbol in enumerate(self.symbols)
            if symbol is None or self.posteriors[place, symbol] < CERTAIN
        )


def decode_tracks(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Callable[[str, float], None] | None = None
) -> Decoding:
    """Decode a message from tracks under a key.

    `progress(stage, fraction)` is called now and then. Raises MtmError when no channel can be read at all.
    """
    scheme = key.scheme
    detector = make_detector(settings.detector, settings.profile)
    bodies = assign_tracks(scheme, tracks, settings.assignment)
    glimpses = {body: _glimpse(track, scheme.rate_hz) for body, track in bodies.items() if track is not None}
    observations = [
        Observation(channel, glimpses[channel.body]) for channel in scheme.channels if channel.body in glimpses
    ]
    decoys = decoy_codebooks(key, settings.decoys)
    report = None if progress is None else partial(progress, "reading")
    results = detector.read(key.codebook(), decoys, observations, settings.onset_s, report)
    read = {
        observation.channel.name: result
        for observation, result in zip(observations, results, strict=True)
        if not isinstance(result, MtmError)
    }
    if not read:
        raise next(result for result in results if isinstance(result, MtmError))
    channels = [
        _channel_decoding(channel, glimpses.get(channel.body), read.get(channel.name), scheme)
        for channel in scheme.channels
    ]
    evidence = detector.weigh(
        float(np.mean([result.reading.strength for result in read.values()])),
        np.mean([result.decoy_strengths for result in read.values()], axis=0),
        sum(result.reading.maxima for result in read.values()),
    )
    posteriors, symbols = _message_symbols(scheme, channels)
    return _decoding(key, settings, tuple(channels), symbols, posteriors, evidence)


def _glimpse(track: Track, rate_hz: float) -> Glimpse:
    glimpse = glimpse_of_track(track)
    lasts_s, most_s = float(glimpse.edges_s[-1] - glimpse.edges_s[0]), _MOST_TICKS / rate_hz
    if not lasts_s <= most_s:
        raise MtmError(
            f"the recording of {track.name!r} lasts {lasts_s:g} s, and no more than {most_s:g} s can be searched; "
            "cut out the part with the message, and check that the times are seconds"
        )
    return glimpse


def _decoding(
    key: Key,
    settings: DecodeSettings,
    channels: tuple[ChannelDecoding, ...],
    symbols: tuple[int | None, ...],
    posteriors: Floats,
    evidence: Evidence,
) -> Decoding:
    order_known = settings.onset_s is not None or all(
        order_is_known(decoding.reading, decoding.channel, key.scheme.schedule)
        for decoding in channels
        if decoding.reading is not None
    )

    def answer(verdict: VerdictName, message: int | None) -> Decoding:
        return Decoding(
            verdict, message, symbols, posteriors, order_known, evidence, channels, key.id, key.scheme, settings
        )

    if evidence.p_value > settings.threshold:
        return answer("absent", None)
    undecided = answer("inconclusive", None)
    if undecided.uncertain or not order_known:
        return undecided
    message = number_of_symbols([symbol for symbol in symbols if symbol is not None], key.scheme)
    return undecided if message is None else answer("decoded", message)


def _channel_decoding(
    channel: Channel, glimpse: Glimpse | None, result: ChannelReading | None, scheme: Scheme
) -> ChannelDecoding:
    if result is None:
        unknown = np.full((channel.symbols, scheme.alphabet_size), 1.0 / scheme.alphabet_size)
        return ChannelDecoding(channel, glimpse, None, unknown)
    return ChannelDecoding(channel, glimpse, result.reading, result.posteriors)


def _message_symbols(scheme: Scheme, channels: Sequence[ChannelDecoding]) -> tuple[Floats, tuple[int | None, ...]]:
    """Posteriors (L, M) and decisions of the message's positions: joined when split, pooled when the same."""
    if scheme.combine == "split":
        posteriors = np.concatenate([decoding.posteriors for decoding in channels])
        seen = [decoding.reading is not None for decoding in channels for _ in range(decoding.channel.symbols)]
        best = np.argmax(posteriors, axis=1)
        return posteriors, tuple(int(symbol) if known else None for symbol, known in zip(best, seen, strict=True))
    read = [decoding for decoding in channels if decoding.reading is not None]
    logs = np.sum([np.log(np.maximum(decoding.posteriors, 1e-300)) for decoding in read], axis=0)
    posteriors = np.exp(logs - logs.max(axis=1, keepdims=True))
    posteriors /= posteriors.sum(axis=1, keepdims=True)
    return posteriors, tuple(_pooled(scheme, read))


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
