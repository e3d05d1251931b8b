"""Timings near a found one, on a grid that is fixed before the key has a say, with their prior probabilities."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats

# A known onset leaves open when the robot followed: from a little before, where clocks differ, to a slow vehicle.
_EARLIEST_S, _LATEST_S = -0.04, 0.42
_SHIFTS = np.arange(-4, 5)
_RATE_STEPS = np.arange(-2, 3)
RATES = len(_RATE_STEPS)
# Of the grid's timings one in so many onsets and rates is a centre; neighbourhoods of all centres overlap as little as
# lets each hold what lies half way to the next, and a plant's spread.
_CENTRE_SHIFTS, _CENTRE_RATES = 5, 3
# Clocks that are off by more are possible but rare: the scale of a Cauchy prior over relative rates.
_USUAL_RATE_ERROR = 0.003


@dataclass(frozen=True)
class Span:
    """Which windows of a channel a recording shows: their `numbers` (windows,), lengths in ticks and cells in seconds.

    The recording begins at `origin_s` and lasts `lasts_s`, the same for all bodies of a film. `order` is how many
    rotations of the message the schedule leaves open, 1 where windows say their number.
    """

    numbers: NDArray[np.int64]
    window_ticks: int
    step_s: float
    origin_s: float
    lasts_s: float
    nominal_hz: float
    order: int


@dataclass(frozen=True)
class Neighbourhood:
    """`starts_s` (timings, windows), and the log prior probability of each timing, (timings,): for each shift of the
    onset `RATES` rates.

    All timings of the grid, of which these are a part, have a prior of sum 1 at the most.
    """

    starts_s: Floats
    log_priors: Floats


def centred(span: Span, timing: Timing, onset: Onset) -> tuple[Timing, float]:
    """The nearest of the grid's centres, and its log weight; the weights of all centres have a sum of 1 at the most.

    So a term that is weighed around a centre may be chosen for what it says, once it has been multiplied by the weight.
    """
    grid = _grid(span, timing, onset)
    rate = round(grid.rate / _CENTRE_RATES) * _CENTRE_RATES
    block = (rate + np.arange(_CENTRE_RATES) - _CENTRE_RATES // 2) * grid.spacing
    weight = float(np.logaddexp.reduce(_log_rate_priors(block, grid.spacing)))
    rate_hz = span.nominal_hz * (1.0 + rate * grid.spacing)
    if isinstance(onset, int | float):
        return Timing(timing.onset_s, rate_hz), weight
    shift = round(grid.shift / _CENTRE_SHIFTS) * _CENTRE_SHIFTS
    onset_s = span.origin_s + shift * grid.half_s - grid.pivot * span.window_ticks / rate_hz
    # The first and the last centre stand for onsets beyond the range as well.
    count = _onsets(span, onset, grid.half_s) + _CENTRE_SHIFTS - 1
    return Timing(onset_s, rate_hz), weight + math.log(_CENTRE_SHIFTS / count)


@dataclass(frozen=True)
class _Grid:
    """Where a timing lies: `rate` in steps of `spacing` beside the nominal one; the window `pivot`, which changes of
    the rate leave in place, begins `shift` half cells of `half_s` after the recording.
    """

    half_s: float
    spacing: float
    rate: int
    pivot: int
    shift: int


def _grid(span: Span, timing: Timing, onset: Onset) -> _Grid:
    """A known onset is the pivot, else it is the middle window."""
    half_s = 0.5 * span.step_s
    known = isinstance(onset, int | float)
    pivot = 0 if known else int(span.numbers[len(span.numbers) // 2])
    spacing = half_s / (span.lasts_s if known else 0.5 * span.lasts_s)
    found_s = timing.onset_s + pivot * span.window_ticks / timing.rate_hz
    rate = round((timing.rate_hz / span.nominal_hz - 1.0) / spacing)
    return _Grid(half_s, spacing, rate, pivot, round((found_s - span.origin_s) / half_s))


def neighbourhood(span: Span, timing: Timing, onset: Onset) -> Neighbourhood:
    """The grid's timings around `timing`: onsets in half cells, rates that move a recording's end by as much."""
    grid = _grid(span, timing, onset)
    half_s, pivot = grid.half_s, grid.pivot
    relative = (grid.rate + _RATE_STEPS) * grid.spacing
    if isinstance(onset, int | float):
        shifts_s = np.arange(math.floor(_EARLIEST_S / half_s), math.ceil(_LATEST_S / half_s) + 1) * half_s
        pivot_s, count = float(onset), len(shifts_s)
    else:
        pivot_s = span.origin_s + grid.shift * half_s
        shifts_s, count = _SHIFTS * half_s, _onsets(span, onset, half_s)
    lengths_s = span.window_ticks / (span.nominal_hz * (1.0 + relative))
    starts_s = pivot_s + shifts_s[:, None, None] + (span.numbers - pivot) * lengths_s[:, None]
    rates = _log_rate_priors(relative, grid.spacing)
    priors = np.broadcast_to(rates - np.log(count), (len(shifts_s), len(relative)))
    return Neighbourhood(starts_s.reshape(-1, len(span.numbers)), priors.ravel())


def _log_rate_priors(relative: Floats, spacing: float) -> Floats:
    """A Cauchy prior on a grid of that spacing, of sum 1 over the whole grid."""
    density = -np.log1p((relative / _USUAL_RATE_ERROR) ** 2)
    # The sum of 1 / (1 + (n a)^2) over all whole n is (pi / a) coth(pi / a).
    turns = np.pi * _USUAL_RATE_ERROR / spacing
    return np.asarray(density + np.log(np.tanh(turns) / turns))


def _onsets(span: Span, onset: Onset, half_s: float) -> int:
    """How many onsets the grid has: one window's worth where nothing is known, for each order of the symbols."""
    if isinstance(onset, OnsetRange):
        return math.ceil((onset.high_s - onset.low_s + _LATEST_S - _EARLIEST_S) / half_s) + 1
    # Neighbourhoods at either end of a window's worth of onsets reach beyond it.
    beyond = 2 * len(_SHIFTS)
    return span.order * (math.ceil(1.25 * span.window_ticks / span.nominal_hz / half_s) + 1 + beyond)


def at_phase_of(own: Timing, other: Timing, window_ticks: int) -> Timing:
    """The other's rate and window phase, counted as `own` counts its windows; the nearest in time."""
    length_s = window_ticks / other.rate_hz
    ahead_s = math.remainder(other.onset_s - own.onset_s, length_s)
    return Timing(own.onset_s + ahead_s, other.rate_hz)
