"""The glimpse: observed motion as mean velocities over the intervals between observations."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.tracks import Bools, Floats, Track
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Glimpse:
    """Mean velocities of one body between consecutive observations.

    `edges_s` (n + 1,) times of the observations; `velocities` (n, axes), the mean over each interval in `unit` per
    second; `valid` (n,) False where an interval bridges a gap (its mean is the displacement over the whole gap).
    """

    name: str
    edges_s: Floats
    velocities: Floats
    valid: Bools
    axes: tuple[str, ...]

    @property
    def starts_s(self) -> Floats:
        """Start of each interval, shape (n,)."""
        return self.edges_s[:-1]

    @property
    def durations_s(self) -> Floats:
        """Length of each interval, shape (n,)."""
        return np.diff(self.edges_s)


def glimpse_of_track(track: Track) -> Glimpse:
    """Difference a track's valid positions.

    An interval longer than 2.5 times the median is marked as a gap. Raises MtmError when fewer than three
    positions are valid.
    """
    times_s, positions = track.times_s[track.valid], track.positions[track.valid]
    if len(times_s) < 3:
        raise MtmError(f"track {track.name!r} was seen in {len(times_s)} frames only; at least 3 are needed")
    durations_s = np.diff(times_s)
    velocities = np.diff(positions, axis=0) / durations_s[:, None]
    valid = durations_s <= 2.5 * np.median(durations_s)
    return Glimpse(track.name, times_s, velocities, valid, track.axes)


def tick_velocities(glimpse: Glimpse, first_tick_s: float, rate_hz: float, ticks: int) -> Floats:
    """Mean velocity over each of `ticks` control periods from `first_tick_s` on: shape (ticks, axes).

    Positions are interpolated linearly at the ticks (through gaps as well) and differenced, so nothing aliases
    that the recording had averaged out. Outside the recording the body stands still.
    """
    steps = glimpse.velocities * glimpse.durations_s[:, None]
    positions = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    instants_s = first_tick_s + np.arange(ticks + 1) / rate_hz
    columns = [np.interp(instants_s, glimpse.edges_s, positions[:, axis]) for axis in range(positions.shape[1])]
    return np.diff(np.stack(columns, axis=1), axis=0) * rate_hz
