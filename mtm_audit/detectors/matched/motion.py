"""Observed motion on a uniform grid, with what was not seen marked as such."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.track import Bools, Floats
from mtm_onboard.protocol.errors import MtmError

# Cells of a fifth of the highest tone's period: little of the band is averaged away, little beyond it folds back.
_CELLS_PER_PERIOD = 5.0
_SHORTEST_GAP_S = 0.15
_FEWEST_CELLS = 16
# Periods of the band's upper edge between two observations; at more of them most of the band averages out.
_MOST_PERIODS = 2.0


@dataclass(frozen=True)
class Motion:
    """Mean velocities over equal cells: `velocities` (axes, n), `seen` (n,), first cell from `start_s` on."""

    start_s: float
    step_s: float
    velocities: Floats
    seen: Bools

    @property
    def middles_s(self) -> Floats:
        """Middle instant of each cell, shape (n,)."""
        return self.start_s + (np.arange(len(self.seen)) + 0.5) * self.step_s


def uniform_motion(glimpse: Glimpse, highest_hz: float) -> Motion:
    """Average a glimpse's velocities over cells that suit a band ending at `highest_hz`.

    Positions are interpolated through the observations, so irregular times and short gaps cost little; cells that
    touch a longer gap are not seen. Raises MtmError when fewer than 16 cells come out, or observations are so rare that
    nothing of the band is left in them.
    """
    usual_s = float(np.median(glimpse.durations_s))
    if usual_s * highest_hz > _MOST_PERIODS:
        raise MtmError(
            f"track {glimpse.name!r} was observed {1.0 / usual_s:.2g} times a second, which is too seldom for a band "
            f"up to {highest_hz:g} Hz; record with {2.0 * highest_hz:g} a second or more"
        )
    step_s = max(usual_s, 1.0 / (_CELLS_PER_PERIOD * highest_hz))
    steps = glimpse.velocities * glimpse.durations_s[:, None]
    positions = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    count = int((glimpse.edges_s[-1] - glimpse.edges_s[0]) / step_s + 1e-6)
    if count < _FEWEST_CELLS:
        raise MtmError(
            f"track {glimpse.name!r} lasts {glimpse.edges_s[-1] - glimpse.edges_s[0]:.2f} s only; record at least "
            f"{_FEWEST_CELLS * step_s:.1f} s"
        )
    edges_s = glimpse.edges_s[0] + np.arange(count + 1) * step_s
    velocities = np.diff(_interpolated(glimpse.edges_s, positions, edges_s), axis=0).T / step_s
    seen = _seen_cells(glimpse, edges_s)
    velocities[:, ~seen] = 0.0
    return Motion(float(glimpse.edges_s[0]), step_s, velocities, seen)


def _interpolated(times_s: Floats, positions: Floats, wanted_s: Floats) -> Floats:
    """Positions (n, axes) at other instants: (wanted, axes).

    Straight between observations that are twice as dense as wanted, since a spline would overshoot where two of them
    come within a fraction of a millisecond, as received time stamps do; a cubic spline where they are sparse, as in a
    film, since a straight line would shorten the fastest swings.
    """
    if np.median(np.diff(times_s)) <= 0.5 * np.median(np.diff(wanted_s)):
        return np.stack([np.interp(wanted_s, times_s, column) for column in positions.T], axis=1)
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(times_s, positions)(wanted_s))


def _seen_cells(glimpse: Glimpse, edges_s: Floats) -> Bools:
    durations_s = glimpse.durations_s
    gaps = np.flatnonzero(durations_s > max(_SHORTEST_GAP_S, 2.5 * float(np.median(durations_s))))
    seen = np.ones(len(edges_s) - 1, dtype=np.bool_)
    for gap in gaps:
        first = np.searchsorted(edges_s, glimpse.edges_s[gap], side="right") - 1
        last = np.searchsorted(edges_s, glimpse.edges_s[gap + 1], side="left")
        seen[max(0, first) : last] = False
    return seen
