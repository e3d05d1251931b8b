"""Where the windows of a message may lie: onsets and fine rates near one coarse rate."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.model.timing import Onset, OnsetRange
from mtm_audit.model.track import Bools, Floats

_DRIFT_S = 0.02
# Clocks that are off by more than this are possible but rare: the scale of a Cauchy prior over relative rates.
_USUAL_RATE_ERROR = 0.003
# Nearly all clocks that follow UTC keep its rate by a quartz: their part, and the scale of a Cauchy prior.
_QUARTZ, _QUARTZ_RATE_ERROR = 0.9, 1e-4
# Log prior, beside the nominal rate's, of rates within a thousandth: quartz is better than that.
_USUAL_LOG_PRIOR = -0.1


@dataclass(frozen=True)
class Grid:
    """All hypotheses near one coarse rate.

    `rates_hz` (fine rates,), `starts` (starts,) lags of window 0, `lags` (fine rates, starts, windows) where each
    window begins, in cells; `inside` which of them can be seen; `rows` (windows,) whose evidence each window takes;
    `prior` (fine rates,) log prior.
    """

    rates_hz: Floats
    starts: Floats
    lags: Floats
    inside: Bools
    rows: NDArray[np.int64]
    prior: Floats


@dataclass(frozen=True)
class Hypothesis:
    """One place of a grid, by fine rate and start, and its log evidence."""

    rate: int
    start: int
    evidence: float


def make_grid(
    motion: Motion,
    nominal_hz: float,
    rate_hz: float,
    spacing: float,
    ticks: int,
    lead: int,
    numbered: int,
    onset: Onset,
) -> Grid:
    """Hypotheses around `rate_hz`, whose coarse neighbours are `spacing` (relative) away.

    Fine rates lie so close that windows drift by less than half a cell between them over the recording. `numbered`
    is how many windows have waveforms of their own (1 under the fixed schedule); `lead` cells precede the recording.
    """
    count = len(motion.seen)
    available = count + lead
    fine = max(1, int(np.ceil(spacing * count * motion.step_s / (2.0 * _DRIFT_S))))
    rates_hz = rate_hz * (1.0 + np.arange(-fine, fine + 1) / (2 * fine + 1) * spacing)
    lengths = ticks / rates_hz / motion.step_s
    rolling = numbered > 1
    if isinstance(onset, OnsetRange):
        bounds = (np.array([onset.low_s, onset.high_s]) - motion.start_s) / motion.step_s + lead
        starts = np.arange(np.floor(bounds[0]), np.ceil(bounds[1]) + 1.0)
    elif onset is not None:
        starts = np.array([(onset - motion.start_s) / motion.step_s + lead])
    else:
        starts = np.arange(available if rolling else int(np.ceil(lengths.max())), dtype=np.float64)
    numbers = np.arange(numbered if rolling else int(np.ceil(available / lengths.min())) + 1)
    lags = starts[None, :, None] + numbers * lengths[:, None, None]
    inside = (lags >= 0) & (lags <= available - 1)
    prior = log_rate_prior(rates_hz, nominal_hz)
    return Grid(rates_hz, starts, lags, inside, numbers if rolling else np.zeros_like(numbers), prior)


def log_rate_prior(rates_hz: Floats, nominal_hz: float) -> Floats:
    """Log prior of clock rates, shape as the input."""
    return np.asarray(-np.log1p(((rates_hz / nominal_hz - 1.0) / _USUAL_RATE_ERROR) ** 2))


def log_clock_prior(rates_hz: Floats, nominal_hz: float) -> Floats:
    """As `log_rate_prior`, where clocks that follow UTC say the rate."""
    error = rates_hz / nominal_hz - 1.0
    quartz, other = _QUARTZ / _QUARTZ_RATE_ERROR, (1.0 - _QUARTZ) / _USUAL_RATE_ERROR
    density = quartz / (1.0 + (error / _QUARTZ_RATE_ERROR) ** 2) + other / (1.0 + (error / _USUAL_RATE_ERROR) ** 2)
    return np.asarray(np.log(density / (quartz + other)))


def fold(evidence: Floats, grid: Grid, most: int, usual: int = 0) -> list[list[Hypothesis]]:
    """Add up the windows' evidence (codebooks, numbered windows, lags) and return each codebook's best hypotheses: the
    `most` best local maxima, and the `usual` best starts at the rates of usual clocks, be they maxima or not.
    """
    places = np.clip(np.rint(grid.lags).astype(np.int64), 0, evidence.shape[2] - 1)
    # Windows that cannot be seen point at a place of their own that says nothing.
    flat = np.where(grid.inside, grid.rows * evidence.shape[2] + places, evidence.shape[1] * evidence.shape[2])
    # Windows outermost, so that sums run along memory.
    flat = np.ascontiguousarray(flat.transpose(2, 0, 1))
    # A window either carries the message or is silent, even odds: a recording may hold more than the message.
    carried = np.logaddexp(0.0, evidence) - np.log(2.0)
    found = []
    for each in carried:
        totals = np.append(each, 0.0)[flat].sum(axis=0) + grid.prior[:, None]
        found.append(list(dict.fromkeys([*_peaks(totals, most), *_usual(totals, grid.prior, usual)])))
    return found


def _usual(totals: Floats, prior: Floats, most: int) -> list[Hypothesis]:
    """The best starts of (fine rates, starts), each at the best rate that nearly every clock has."""
    rates = np.flatnonzero(prior > _USUAL_LOG_PRIOR)
    if most == 0 or not len(rates):
        return []
    best = np.argmax(totals[rates], axis=0)
    ridge = totals[rates[best], np.arange(totals.shape[1])]
    return [Hypothesis(int(rates[best[start]]), int(start), float(ridge[start])) for start in np.argsort(-ridge)[:most]]


def _peaks(totals: Floats, most: int) -> list[Hypothesis]:
    """The best starts of (fine rates, starts), each at its best rate."""
    rates = np.argmax(totals, axis=0)
    ridge = totals[rates, np.arange(totals.shape[1])]
    padded = np.concatenate([[-np.inf], ridge, [-np.inf]])
    peaks = np.flatnonzero((ridge >= padded[:-2]) & (ridge >= padded[2:]))
    chosen = peaks[np.argsort(-ridge[peaks])[:most]]
    return [Hypothesis(int(rates[start]), int(start), float(ridge[start])) for start in chosen]
