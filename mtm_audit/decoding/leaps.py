"""Leaps of a track that its body cannot have made: a marker misread for a frame, two labels exchanged."""

from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.model.track import Bools, Floats, Track

# A step this many times as fast as all but a hundredth of the steps is a leap; quick motion lasts longer than two.
_TIMES_USUAL = 10.0
_USUAL_QUANTILE = 0.99
_LONGEST_RUN = 2
_FEWEST_STEPS = 50


@dataclass(frozen=True)
class Mended:
    """A track without its leaps, and how many there were."""

    track: Track
    leaps: int


def without_leaps(track: Track) -> Mended:
    """The track with the observation after each leap unseen and all later ones moved back by it.

    A single wrong position is two leaps, there and back, and costs that one observation.
    """
    seen = np.flatnonzero(track.valid)
    if len(seen) <= _FEWEST_STEPS:
        return Mended(track, 0)
    times_s, positions = track.times_s[seen], track.positions[seen]
    steps, durations_s = np.diff(positions, axis=0), np.diff(times_s)
    leaps = _leaps(steps, durations_s)
    if not leaps.any():
        return Mended(track, 0)
    steps[leaps] = 0.0
    velocities = steps[~leaps] / durations_s[~leaps, None]
    middles_s = times_s[:-1] + 0.5 * durations_s
    for axis in range(steps.shape[1]):
        usual = np.interp(middles_s[leaps], middles_s[~leaps], velocities[:, axis])
        steps[leaps, axis] = usual * durations_s[leaps]
    mended = track.positions.copy()
    mended[seen[1:]] = positions[0] + np.cumsum(steps, axis=0)
    valid = track.valid.copy()
    valid[seen[1:][leaps]] = False
    mended[~valid] = np.nan
    return Mended(replace(track, positions=mended, valid=valid), int(leaps.sum()))


def _leaps(steps: Floats, durations_s: Floats) -> Bools:
    """Which steps (n, axes) are leaps, (n,); where stamps come in bursts a step is judged by the usual interval."""
    lengths = np.linalg.norm(steps, axis=1)
    speeds = lengths / np.maximum(durations_s, np.median(durations_s))
    fast = speeds > _TIMES_USUAL * max(float(np.quantile(speeds, _USUAL_QUANTILE)), 1e-12)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]])))
    for begin, end in edges.reshape(-1, 2):
        if end - begin > _LONGEST_RUN:
            fast[begin:end] = False
    return np.asarray(fast)
