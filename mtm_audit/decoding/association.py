"""Which track shows which body: what names say, a search for the rest, and what it costs to choose."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.decoding.assignment import Assignment
from mtm_audit.decoding.pairing import best_pairs
from mtm_audit.decoding.views import view_strengths
from mtm_audit.detectors.base import Detector
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Onset
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# Prior probability that a track shows the body that its name says, where there are others.
_NAMED = 0.9
# Less than this is what a search among tracks finds by chance, and not worth reading all channels again.
_WORTH_NATS = 10.0


@dataclass(frozen=True, kw_only=True)
class Association:
    """`glimpses` by body; `log_priors` by body, what choosing its track costs (0 where there was no choice).

    `searched` are bodies that no name settled, `exchanged` those whose name said another track. `strengths`
    (1 + decoys,) is what the search added for each codebook under its own choice, None without a search or decoys.
    """

    glimpses: Mapping[str, Glimpse]
    log_priors: Mapping[str, float]
    searched: frozenset[str] = frozenset()
    exchanged: frozenset[str] = frozenset()
    strengths: Floats | None = None


def associate(
    assignment: Assignment,
    settled: Mapping[str, Glimpse],
    free: Sequence[Glimpse],
    channels: Sequence[Channel],
    detector: Detector,
    codebooks: Sequence[Codebook],
    onset: Onset,
) -> Association:
    """What names settle stays; the other bodies get the free glimpses that suit them best, one each."""
    count = len(settled) + len(free)
    named = 0.0 if count < 2 else math.log(_NAMED)
    association = Association(glimpses=dict(settled), log_priors=dict.fromkeys(settled, named))
    open_channels = [channel for channel in channels if channel.body in assignment.unsettled]
    if not (open_channels and free):
        return association
    strengths = view_strengths(detector, codebooks, open_channels, free, onset)
    found, sums = best_pairs(open_channels, strengths)
    return replace(
        association,
        glimpses={**association.glimpses, **{body: free[place] for body, place in found.items()}},
        log_priors={**association.log_priors, **dict.fromkeys(found, -math.log(count))},
        searched=frozenset(found),
        strengths=sums if len(codebooks) > 1 else None,
    )


def exchanged(
    association: Association,
    bodies: Sequence[str],
    tracks: Sequence[Glimpse],
    channels: Sequence[Channel],
    strengths: Floats,
) -> Association | None:
    """The association in which `bodies` have those of `tracks` that suit them best; None when that is today's.

    `strengths` (channels, tracks) of all `channels`. Tracks not given to one of `bodies` keep theirs.
    """
    rows = [row for row, channel in enumerate(channels) if channel.body in bodies]
    found, _ = best_pairs([channels[row] for row in rows], strengths[None, rows])
    moved = {
        body: tracks[place] for body, place in found.items() if tracks[place] is not association.glimpses.get(body)
    }
    if not moved or _gain(moved, association, tracks, channels, strengths) < _WORTH_NATS:
        return None
    others = max(1, len(tracks) - 1)
    costs = {
        body: association.log_priors[body] if body in association.searched else math.log((1.0 - _NAMED) / others)
        for body in moved
    }
    return replace(
        association,
        glimpses={**association.glimpses, **moved},
        log_priors={**association.log_priors, **costs},
        exchanged=frozenset(moved) - association.searched,
    )


def _gain(
    moved: Mapping[str, Glimpse],
    association: Association,
    tracks: Sequence[Glimpse],
    channels: Sequence[Channel],
    strengths: Floats,
) -> float:
    """How much more log evidence the moved bodies' channels have in their new tracks than in today's."""
    columns = {id(track): column for column, track in enumerate(tracks)}
    gain = 0.0
    for row, channel in enumerate(channels):
        if channel.body in moved:
            before = columns.get(id(association.glimpses.get(channel.body)))
            old = 0.0 if before is None else float(np.nan_to_num(strengths[row, before], nan=0.0))
            gain += float(strengths[row, columns[id(moved[channel.body])]]) - old
    return gain


def shown_elsewhere(
    strengths: Floats, channels: Sequence[Channel], tracks: Sequence[Glimpse], least_nats: float
) -> dict[str, str]:
    """By track name the channel that its motion plays, where the evidence (channels, tracks) is at least that much."""
    values = np.where(np.isfinite(strengths), strengths, -np.inf)
    rows = np.argmax(values, axis=0)
    return {
        track.name: channels[row].name
        for column, (track, row) in enumerate(zip(tracks, rows, strict=True))
        if values[row, column] >= least_nats
    }
