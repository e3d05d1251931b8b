"""The glimpse: observed motion as mean velocities over the intervals between observations."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mtm_audit.model.track import Bools, Floats, Track
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Glimpse:
    """Mean velocities of one body between consecutive observations.

    `edges_s` (n + 1,) times of the observations; `velocities` (n, axes), the mean over each interval in `unit` per
    second; `valid` (n,) False where an interval bridges a gap (its mean is the displacement over the whole gap).
    `headings_rad` (n + 1,) at the edges, unwrapped, None where they are not known.
    """

    name: str
    edges_s: Floats
    velocities: Floats
    valid: Bools
    axes: tuple[str, ...]
    headings_rad: Floats | None = None

    @property
    def starts_s(self) -> Floats:
        """Start of each interval, shape (n,)."""
        return self.edges_s[:-1]

    @property
    def durations_s(self) -> Floats:
        """Length of each interval, shape (n,)."""
        return np.diff(self.edges_s)

    @cached_property
    def displacements(self) -> Floats:
        """Position at each edge relative to the first, shape (n + 1, axes)."""
        steps = self.velocities * self.durations_s[:, None]
        return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


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
    return Glimpse(track.name, times_s, velocities, valid, track.axes, _headings_at(track))


def _headings_at(track: Track) -> Floats | None:
    """Headings where the track is valid, unwrapped, straight through missing ones; None when half of them are."""
    if track.headings_rad is None:
        return None
    headings_rad = track.headings_rad[track.valid]
    known = np.isfinite(headings_rad)
    if known.sum() <= 0.5 * len(known):
        return None
    times_s = track.times_s[track.valid]
    return np.interp(times_s, times_s[known], np.unwrap(headings_rad[known]))


def tick_velocities(glimpse: Glimpse, first_tick_s: float, rate_hz: float, ticks: int) -> Floats:
    """Mean velocity over each of `ticks` control periods from `first_tick_s` on: shape (ticks, axes).

    Positions are interpolated linearly at the ticks (through gaps as well) and differenced, so nothing aliases
    that the recording had averaged out. Outside the recording the body stands still.
    """
    velocities: Floats = tick_velocities_at_rates(glimpse, np.array([first_tick_s]), np.array([rate_hz]), ticks)[0].T
    return velocities


def tick_velocities_at_rates(glimpse: Glimpse, first_ticks_s: Floats, rates_hz: Floats, ticks: int) -> Floats:
    """`tick_velocities` for several rates at once, each from its own first tick on: shape (rates, axes, ticks)."""
    instants_s = first_ticks_s[:, None] + np.arange(ticks + 1) / rates_hz[:, None]
    columns = [np.interp(instants_s, glimpse.edges_s, column) for column in glimpse.displacements.T]
    velocities: Floats = np.diff(np.stack(columns, axis=1), axis=-1) * rates_hz[:, None, None]
    return velocities
