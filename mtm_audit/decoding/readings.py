"""What tracks say under a key: each body's track is read, and the evidence of all is put together."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mtm_audit.decoding.assignment import Assignment
from mtm_audit.decoding.association import Association, associate, exchanged, shown_elsewhere
from mtm_audit.decoding.start import Start
from mtm_audit.decoding.views import Part, frames_of, parts_of, together, view_strengths
from mtm_audit.detectors.base import ChannelReading, Detector
from mtm_audit.detectors.matched.candidates import forget
from mtm_audit.model.glimpse import Glimpse, glimpse_of_track
from mtm_audit.model.reference_frame import ReferenceFrame
from mtm_audit.model.stage import stage
from mtm_audit.model.track import Floats, Track
from mtm_audit.significance.channel_terms import ChannelTerms, channel_terms
from mtm_audit.significance.decoys import compare, decoy_codebooks
from mtm_audit.significance.evidence import Evidence, needed_nats
from mtm_audit.significance.message_evidence import MessageEvidence, weigh_message
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Channel, Scheme

# The onset search takes about a kilobyte a tick; at 50 Hz this is 2.8 h.
_MOST_TICKS = 500_000

# A stage's name and how far it is, 0 to 1.
Progress = Callable[[str, float], None]


def part_of(progress: Progress | None, what: str, number: int, count: int) -> Progress | None:
    """The progress of one of so many tries, such as pieces or speeds, told as part of the whole."""
    if progress is None:
        return None
    return lambda stage, fraction: progress(f"{what} {number + 1} of {count}: {stage}", (number + fraction) / count)


@dataclass(frozen=True)
class WeighedPart:
    """A part of a channel on some of its axes, and the log prior probability of its track."""

    axes: tuple[str, ...]
    terms: ChannelTerms
    cost: float


@dataclass(frozen=True, kw_only=True)
class Readings:
    """`channels` by name, those that could be read, and `refusals` why others could not; `message` the exact evidence,
    None from a detector that gives none, and `channel_nats` by channel name; `also_shows` by track name which channel
    its motion plays, where tracks were compared. `frame` is the one whose axes the motion was read along; `weighed` is
    what the evidence was made of.
    """

    association: Association
    frame: ReferenceFrame
    channels: Mapping[str, ChannelReading]
    refusals: Mapping[str, MtmError]
    evidence: Evidence
    message: MessageEvidence | None
    channel_nats: Mapping[str, float]
    also_shows: Mapping[str, str]
    weighed: Sequence[WeighedPart]


def read_tracks(
    assignment: Assignment,
    key: Key,
    detector: Detector,
    decoys: int,
    threshold: float,
    start: Start,
    progress: Progress | None = None,
) -> Readings:
    """Read each body's track, after a search for those bodies whose track nothing settles.

    Where channels show nothing, their tracks are exchanged among them and the better association is kept: names may
    be wrong. Raises MtmError when no channel can be read.
    """
    codebooks = [key.codebook(start.first_slot), *decoy_codebooks(key, decoys, start.first_slot)]
    scheme = key.scheme
    settled, refused = usable_glimpses(assignment.settled.values(), scheme.rate_hz)
    by_track = {glimpse.name: glimpse for glimpse in settled}
    bodies = {body: by_track[track.name] for body, track in assignment.settled.items() if track.name in by_track}
    free, more = usable_glimpses(assignment.free, scheme.rate_hz)
    if not bodies and not free:
        with stage("glimpse"):
            raise next(iter([*refused, *more]))
    association = associate(assignment, bodies, free, scheme.channels, detector, codebooks, start.onset)
    read = _Reader(codebooks, detector, start, threshold, progress)
    first = read.under(association)
    if not first.channels:
        with stage("glimpse" if refused else "timing"):
            raise next(iter([*refused, *first.refusals.values(), *more, _nothing_to_read()]))
    if first.message is None:
        return first
    return _with_better_tracks(first, free, read) or first


@dataclass(frozen=True, kw_only=True)
class _View:
    """What all channels say in one frame; `parts` by channel name, `strengths` (1 + decoys,) mean strengths."""

    frame: ReferenceFrame
    parts: Mapping[str, Sequence[Part]]
    refusals: Mapping[str, MtmError]
    weighed: Sequence[WeighedPart]
    message: MessageEvidence | None
    strengths: Floats

    @property
    def rank(self) -> tuple[int, float]:
        """The more channels, and then the more evidence, the better."""
        return len(self.parts), float(self.strengths[0]) if self.message is None else self.message.presence_nats

    @property
    def maxima(self) -> int:
        """Over how many maxima over candidates the strength is a mean."""
        results = [part.result for each in self.parts.values() for part in each]
        return sum(len(np.unique(result.reading.window_positions)) for result in results)


@dataclass(frozen=True)
class _Reader:
    """Reads all channels under one association after the other."""

    codebooks: Sequence[Codebook]
    detector: Detector
    start: Start
    threshold: float
    progress: Progress | None

    @property
    def scheme(self) -> Scheme:
        """The scheme of all codebooks."""
        return self.codebooks[0].scheme

    def under(self, association: Association, also_shows: Mapping[str, str] | None = None) -> Readings:
        """What all channels say with these tracks, in the frame in which they say most."""
        channels = [channel for channel in self.scheme.channels if channel.body in association.glimpses]
        frames = frames_of(channels, association.glimpses.values())
        best = self._view(channels, association, frames[0])
        sums = best.strengths
        # One after the other, since what a large alphabet's candidates say takes memory.
        for frame in frames[1:]:
            view = self._view(channels, association, frame)
            sums = np.maximum(sums, view.strengths)
            best = max(best, view, key=lambda each: each.rank)
        message = None if best.message is None else best.message.discounted(math.log(len(frames)))
        decoys = None
        if len(self.codebooks) > 1 and best.parts:
            decoys = compare(sums, self.detector.strength_law, best.maxima)
        return Readings(
            association=association,
            frame=best.frame,
            channels={name: parts[0].result for name, parts in best.parts.items()},
            refusals=best.refusals,
            evidence=Evidence(None if message is None else message.presence_nats, decoys),
            message=message,
            channel_nats={} if message is None else message.channels_nats,
            also_shows=also_shows or {},
            weighed=[replace(part, cost=part.cost - math.log(len(frames))) for part in best.weighed],
        )

    def _view(self, channels: Sequence[Channel], association: Association, frame: ReferenceFrame) -> _View:
        read, refusals = self._apart(channels, association, frame)
        if self.scheme.schedule == "fixed":
            # Evidence looks at a few candidates, and takes the memory of all for its tables.
            forget(self.codebooks[0])
        log_evidence = self.detector.strength_law == "log evidence"
        # What a channel's parts say is not kept beside what they say together.
        parts = {name: together(read.pop(name), log_evidence=log_evidence) for name in list(read)}
        weighed = self._weighed(parts, association)
        return _View(
            frame=frame,
            parts=parts,
            refusals={name: refusal for name, refusal in refusals.items() if name not in parts},
            weighed=weighed,
            message=self._message(weighed) if weighed else None,
            strengths=_strengths(self.scheme, parts, association) if parts else np.zeros(len(self.codebooks)),
        )

    def _apart(
        self, channels: Sequence[Channel], association: Association, frame: ReferenceFrame
    ) -> tuple[dict[str, list[Part]], dict[str, MtmError]]:
        """By channel name its parts, each by itself, and why others could not be read."""
        observations = [
            observation
            for channel in channels
            for observation in parts_of(channel, association.glimpses[channel.body], frame)
        ]
        report = None if self.progress is None else partial(self.progress, "reading")
        results = self.detector.read(self.codebooks[0], self.codebooks[1:], observations, self.start.onset, report)
        read: dict[str, list[Part]] = {}
        refusals: dict[str, MtmError] = {}
        for observation, result in zip(observations, results, strict=True):
            if isinstance(result, MtmError):
                refusals[observation.channel.name] = result
            else:
                read.setdefault(observation.channel.name, []).append(Part(observation.channel, result))
        return read, refusals

    def _weighed(self, parts: Mapping[str, Sequence[Part]], association: Association) -> list[WeighedPart]:
        """What exact evidence is made of, with the choice of tracks paid for; none without prepared motions."""
        flat = [part for each in parts.values() for part in each]
        if any(part.result.prepared is None for part in flat):
            return []
        scheme = self.scheme
        apart = scheme.framing is not None and scheme.schedule == "rolling"
        return [
            WeighedPart(
                part.channel.axes,
                channel_terms(self.codebooks[0], part.channel, part.result, self.start.onset, apart=apart),
                association.log_priors[part.channel.body],
            )
            for part in flat
        ]

    def _message(self, weighed: Sequence[WeighedPart]) -> MessageEvidence:
        scheme = self.scheme
        return weigh_message(
            [part.terms for part in weighed],
            [part.cost for part in weighed],
            scheme.message_symbols,
            # A frame's symbols have a check of their own, and where nothing speaks for a message no threshold is met.
            symbols_above_nats=0.0 if scheme.framing is None else math.inf,
        )

    def in_doubt(self, readings: Readings) -> list[str]:
        """Bodies with a channel whose motion does not show its symbols, or that no track shows."""
        scheme = self.scheme
        doubtful: list[str] = []
        for channel in scheme.channels:
            if channel.name not in readings.channels or not self._shows(channel.name, readings):
                doubtful.append(channel.body)
        return list(dict.fromkeys(doubtful))

    def _shows(self, name: str, readings: Readings) -> bool:
        scheme, message = self.scheme, readings.message
        if message is None or scheme.framing is not None or scheme.combine == "same":
            return readings.channel_nats.get(name, -math.inf) >= math.log(1.0 / self.threshold)
        channel = next(channel for channel in scheme.channels if channel.name == name)
        first = scheme.first_position(channel)
        needed = needed_nats(self.threshold, scheme.alphabet_size, scheme.message_symbols)
        places = message.symbols[first : first + channel.symbols]
        return all(place is not None and place.nats >= needed for place in places)


def _with_better_tracks(first: Readings, free: Sequence[Glimpse], reader: _Reader) -> Readings | None:
    """The readings with tracks exchanged among the channels in doubt; None when that is not better."""
    doubtful = reader.in_doubt(first)
    glimpses = first.association.glimpses
    taken = {id(glimpse) for glimpse in glimpses.values()}
    tracks = [glimpses[body] for body in doubtful if body in glimpses]
    tracks += [glimpse for glimpse in free if id(glimpse) not in taken]
    channels, start = reader.scheme.channels, reader.start
    alone = len(channels) == len(tracks) == len(glimpses) == 1
    if not doubtful or not tracks or alone:
        return None
    # A second guess at names is worth no search of clocks that are far off as well.
    strengths = view_strengths(reader.detector, reader.codebooks[:1], channels, tracks, start.onset, usual_rates=True)[
        0
    ]
    also = shown_elsewhere(strengths, channels, tracks, math.log(1.0 / reader.threshold))
    better = exchanged(first.association, doubtful, tracks, channels, strengths)
    if better is not None:
        second = reader.under(better, also)
        if len(second.channels) >= len(first.channels) and (second.evidence.nats or 0.0) > (first.evidence.nats or 0.0):
            return second
    return replace(first, also_shows=also)


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


def _nothing_to_read() -> MtmError:
    return MtmError("no track can be read as any channel; record longer, with the robots in sight")


def _strengths(scheme: Scheme, parts: Mapping[str, Sequence[Part]], association: Association) -> Floats:
    """The mean strength over all channels, (1 + decoys,), each codebook under its own choice of tracks."""
    results = {name: each[0].result for name, each in parts.items()}
    searched = {channel.name for channel in scheme.channels if channel.body in association.searched}
    sums: Floats = np.zeros(1 + len(next(iter(results.values())).decoy_strengths))
    if association.strengths is not None:
        sums = sums + association.strengths
    for name, result in results.items():
        if association.strengths is None or name not in searched:
            sums = sums + np.concatenate([[result.reading.strength], result.decoy_strengths])
    return sums / len(results)
