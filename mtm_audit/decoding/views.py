"""What of a body's motion shows which axes of its channel: planar velocities and the yaw rate, in one frame.

Both are motions of their own kind, in units and with plants of their own, that carry the same symbols at the same time.
Each is read as if it were a channel, and what they say is added up.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from scipy.special import softmax

from mtm_audit.detectors.base import ChannelReading, Detector, Observation
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.reference_frame import (
    REFERENCE_FRAMES,
    ReferenceFrame,
    along_own_axes,
    known_frames,
    shows_heading,
    turning,
)
from mtm_audit.model.timing import Onset
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# Names of axes about which a robot turns, as the robot's side and common robot software call them.
_TURNING_AXES = frozenset({"wz", "yaw", "yaw_rate", "yawrate", "omega", "angular_z"})
# Parts whose windows begin within this of each other show the same windows.
_SAME_WINDOW_S = 0.3
_LEAST = 1e-300


def frames_of(channels: Sequence[Channel], glimpses: Iterable[Glimpse]) -> tuple[ReferenceFrame, ...]:
    """The frames in which motion is worth reading: those that some track can tell apart.

    The path shows the heading of robots that cannot move sideways: of channels with one planar axis.
    """
    seen = list(glimpses)
    # What a robot's turning is seen by, its forward speed is seen along as well.
    if any(_turning(channel) for channel in channels) and any(shows_heading(glimpse) for glimpse in seen):
        return ("body",)
    known = {frame for glimpse in seen for frame in known_frames(glimpse)}
    if any(len(_planar(channel)) > 1 for channel in channels):
        known.discard("path")
    return tuple(frame for frame in REFERENCE_FRAMES if frame in known) or ("world",)


def parts_of(channel: Channel, glimpse: Glimpse, frame: ReferenceFrame) -> list[Observation]:
    """The channel's axes with the motion that shows them: planar ones, and those of turning where a heading is known.

    Without a heading a channel is read from planar motion alone; its other axes are then taken for planar ones.
    """
    planar, turned = _planar(channel), _turning(channel)
    yaw = turning(glimpse, frame) if turned else None
    own = along_own_axes(glimpse, frame)
    if yaw is None:
        return [Observation(channel, own)]
    parts = [Observation(channel.on(planar), own)] if planar else []
    return [*parts, Observation(channel.on(turned), yaw)]


def _turning(channel: Channel) -> tuple[str, ...]:
    """The channel's axes of turning, which follow each other; none when they lie between others."""
    turned = tuple(axis for axis in channel.axes if axis in _TURNING_AXES)
    inner = bool(turned) and turned not in (channel.axes[: len(turned)], channel.axes[-len(turned) :])
    return () if inner else turned


def _planar(channel: Channel) -> tuple[str, ...]:
    turned = _turning(channel)
    return tuple(axis for axis in channel.axes if axis not in turned)


@dataclass(frozen=True)
class Part:
    """Those axes of a channel that one kind of motion shows, and what was read of them."""

    channel: Channel
    result: ChannelReading


def together(parts: Sequence[Part], *, log_evidence: bool) -> list[Part]:
    """The parts of one channel with the scores of all; the strongest first, whose windows the others share.

    A part that was read at another time is left out. With `log_evidence` strengths and scores add up, else they are
    means.
    """
    if len(parts) == 1:
        return list(parts)
    strongest = max(parts, key=lambda part: part.result.reading.strength)
    others = [part for part in parts if part is not strongest and _same_windows(part.result, strongest.result)]
    shared = [strongest, *others]
    results = [part.result for part in shared]
    scale = 1.0 if log_evidence else 1.0 / len(shared)
    scores = scale * np.sum([result.reading.scores for result in results], axis=0)
    ratios = reduce(np.add, [result.window_ratios for result in results])
    # Scores that are log-likelihood ratios are held once.
    alike = log_evidence and all(result.window_ratios is result.reading.window_scores for result in results)
    window_scores = ratios if alike else scale * reduce(np.add, [result.reading.window_scores for result in results])
    log_posteriors = np.sum([np.log(np.maximum(result.posteriors, _LEAST)) for result in results], axis=0)
    strength = scale * sum(result.reading.strength for result in results)
    decoys = scale * np.sum([result.decoy_strengths for result in results], axis=0)
    return [
        Part(
            part.channel,
            replace(
                part.result,
                reading=replace(part.result.reading, scores=scores, window_scores=window_scores, strength=strength),
                posteriors=np.asarray(softmax(log_posteriors, axis=1)),
                window_ratios=ratios,
                decoy_strengths=decoys,
            ),
        )
        for part in shared
    ]


def _same_windows(one: ChannelReading, other: ChannelReading) -> bool:
    mine, theirs = one.reading, other.reading
    if not np.array_equal(mine.window_numbers, theirs.window_numbers):
        return False
    return bool(np.all(np.abs(mine.window_starts_s - theirs.window_starts_s) < _SAME_WINDOW_S))


def view_strengths(
    detector: Detector,
    codebooks: Sequence[Codebook],
    channels: Sequence[Channel],
    glimpses: Sequence[Glimpse],
    onset: Onset,
    *,
    usual_rates: bool = False,
) -> Floats:
    """The detector's strengths, (codebooks, channels, glimpses), each in the frame in which it is largest.

    Every codebook has the same choice, so that the key remains one of its decoys when there is no message.
    """
    shape = (len(codebooks), len(channels), len(glimpses))
    best = np.full(shape, np.nan)
    for frame in frames_of(channels, glimpses):
        found = np.full(shape, np.nan)
        for part in range(2):
            pairs = _pairs_of_kind(channels, glimpses, frame, part)
            if pairs is not None:
                rows, own, columns, seen = pairs
                strengths = detector.strengths(codebooks, own, seen, onset, usual_rates=usual_rates)
                at = np.ix_(range(len(codebooks)), rows, columns)
                both = np.isfinite(found[at]) & np.isfinite(strengths)
                found[at] = np.where(both, found[at] + strengths, np.fmax(found[at], strengths))
        best = np.fmax(best, found)
    return best


def _pairs_of_kind(
    channels: Sequence[Channel], glimpses: Sequence[Glimpse], frame: ReferenceFrame, part: int
) -> tuple[list[int], list[Channel], list[int], list[Glimpse]] | None:
    """Channels and glimpses by number, their planar part (0) or that of turning (1); None when there is none."""
    if part == 0:
        own = {row: _planar(channel) for row, channel in enumerate(channels)}
        seen = {column: along_own_axes(glimpse, frame) for column, glimpse in enumerate(glimpses)}
    else:
        own = {row: _turning(channel) for row, channel in enumerate(channels)}
        turns = ((column, turning(glimpse, frame)) for column, glimpse in enumerate(glimpses))
        seen = {column: glimpse for column, glimpse in turns if glimpse is not None}
    rows = [row for row, axes in own.items() if axes]
    if not rows or not seen:
        return None
    return rows, [channels[row].on(own[row]) for row in rows], list(seen), list(seen.values())
