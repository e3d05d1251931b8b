"""What tracks say under a key and its decoys: each body's track is read, and the evidence of all is put together."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mtm_audit.decoding.assignment import Assignment
from mtm_audit.decoding.pairing import Pairing, all_strengths, search_pairs
from mtm_audit.decoding.start import Start
from mtm_audit.detectors.base import ChannelReading, Detector, Observation
from mtm_audit.model.glimpse import Glimpse, glimpse_of_track
from mtm_audit.model.track import Track
from mtm_audit.significance.decoys import Evidence, decoy_codebooks
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Scheme

# The onset search takes about a kilobyte a tick; at 50 Hz this is 2.8 h.
_MOST_TICKS = 500_000

# A stage's name and how far it is, 0 to 1.
Progress = Callable[[str, float], None]
# Reads observations under the key and all decoys, told what the stage is called.
_Read = Callable[[Sequence[Observation], str | None], list[ChannelReading | MtmError]]


@dataclass(frozen=True)
class Readings:
    """`glimpses` by body; `channels` by name, those that could be read; `searched` are bodies whose track was found
    by search.
    """

    glimpses: Mapping[str, Glimpse]
    channels: Mapping[str, ChannelReading]
    searched: frozenset[str]
    evidence: Evidence


def read_tracks(
    assignment: Assignment,
    key: Key,
    detector: Detector,
    decoys: int,
    start: Start,
    progress: Progress | None = None,
) -> Readings:
    """Read each body's track, after a search for those bodies whose track nothing settles.

    Symbols are read from all bodies together once the pairs are chosen, evidence from the settled bodies and the
    search alone: reading together depends on what the key chose, and would favour it over its decoys. Raises MtmError
    when no channel can be read.
    """
    codebook, others = key.codebook(start.first_slot), decoy_codebooks(key, decoys, start.first_slot)

    def read(observations: Sequence[Observation], stage: str | None) -> list[ChannelReading | MtmError]:
        report = None if progress is None or stage is None else partial(progress, stage)
        return detector.read(codebook, others, observations, start.onset, report)

    scheme = key.scheme
    settled = {body: glimpse_to_search(track, scheme.rate_hz) for body, track in assignment.settled.items()}
    first, refusals = _read_bodies(scheme, settled, read)
    to_search = bool(assignment.unsettled and assignment.free)
    pairing = _searched(assignment, scheme, read, progress, first) if to_search else None
    if pairing is None:
        if not first:
            raise refusals[0]
        return Readings(settled, first, frozenset(), _weigh(detector, first.values(), None))
    glimpses, apart = settled | pairing.glimpses, first | pairing.readings
    together, _ = _read_bodies(scheme, glimpses, read)
    channels = {name: _with_strength_of(result, apart.get(name)) for name, result in together.items()}
    evidence = _weigh(detector, first.values(), pairing)
    return Readings(glimpses, channels, frozenset(pairing.glimpses), evidence)


def glimpse_to_search(track: Track, rate_hz: float) -> Glimpse:
    """The track's glimpse; raises MtmError when it is empty, or longer than a search can take."""
    glimpse = glimpse_of_track(track)
    lasts_s, most_s = float(glimpse.edges_s[-1] - glimpse.edges_s[0]), _MOST_TICKS / rate_hz
    if not lasts_s <= most_s:
        raise MtmError(
            f"the recording of {track.name!r} lasts {lasts_s:g} s, and no more than {most_s:g} s can be searched; "
            "cut out the part with the message, and check that the times are seconds"
        )
    return glimpse


def usable_glimpses(tracks: Iterable[Track], rate_hz: float) -> tuple[list[Glimpse], list[MtmError]]:
    """The glimpses of those tracks that have one, and why the others have none."""
    glimpses, refusals = [], []
    for track in tracks:
        try:
            glimpses.append(glimpse_to_search(track, rate_hz))
        except MtmError as refusal:
            refusals.append(refusal)
    return glimpses, refusals


def _searched(
    assignment: Assignment, scheme: Scheme, read: _Read, progress: Progress | None, first: Mapping[str, ChannelReading]
) -> Pairing | None:
    """The search for unsettled bodies; None when no free track can be read while the settled ones, `first`, can."""
    glimpses, refusals = usable_glimpses(assignment.free, scheme.rate_hz)
    channels = [channel for channel in scheme.channels if channel.body in assignment.unsettled]
    try:
        if not glimpses:
            raise refusals[0]
        report = None if progress is None else partial(progress, "matching tracks")
        return search_pairs(channels, glimpses, lambda observations: read(observations, None), report)
    except MtmError:
        if not first:
            raise
        return None


def _read_bodies(
    scheme: Scheme, glimpses: Mapping[str, Glimpse], read: _Read
) -> tuple[dict[str, ChannelReading], list[MtmError]]:
    """By channel name what could be read, and why the rest could not."""
    observations = [
        Observation(channel, glimpses[channel.body]) for channel in scheme.channels if channel.body in glimpses
    ]
    results = read(observations, "reading") if observations else []
    found: dict[str, ChannelReading] = {}
    refusals: list[MtmError] = []
    for observation, result in zip(observations, results, strict=True):
        if isinstance(result, MtmError):
            refusals.append(result)
        else:
            found[observation.channel.name] = result
    return found, refusals


def _weigh(detector: Detector, settled: Iterable[ChannelReading], pairing: Pairing | None) -> Evidence:
    """The evidence of the mean over all channels: those settled, and those of the search under each one's choice."""
    results = list(settled)
    sums = np.sum([all_strengths(result) for result in results], axis=0)
    if pairing is not None:
        sums = sums + pairing.strengths
        results += pairing.readings.values()
    means = sums / len(results)
    return detector.weigh(float(means[0]), means[1:], sum(result.reading.maxima for result in results))


def _with_strength_of(result: ChannelReading, before: ChannelReading | None) -> ChannelReading:
    """The reading with the strength that the evidence rests on."""
    if before is None:
        return result
    reading = replace(result.reading, strength=before.reading.strength)
    return replace(result, reading=reading, decoy_strengths=before.decoy_strengths)
