"""Accuracy curves: one channel and alphabet over the window length."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from mtm_audit.model.track import Floats
from mtm_audit.planning.table import AccuracyPoint

Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Curve:
    """Symbol accuracy a_c(t, M) of one channel, with the counts it rests on.

    `window_ticks` (n,) ascending; `successes` and `trials` (n,) are those of the point, or of its whole block where
    smoothing pooled neighbours. With `measured_only` the curve exists at its points alone, else between them as well:
    there the logarithm of the error rate is interpolated. It never exists outside the measured range.
    """

    channel: str
    alphabet_size: int
    window_ticks: Integers
    successes: Integers
    trials: Integers
    blocks: Integers
    measured_only: bool

    @property
    def errors(self) -> Floats:
        """Error rates at the points, (n,)."""
        rates: Floats = 1.0 - self.successes / self.trials
        return rates

    def exists_at(self, window_ticks: int) -> bool:
        """Whether the curve says anything of windows of that length."""
        if self.measured_only:
            return bool(np.any(self.window_ticks == window_ticks))
        return bool(self.window_ticks[0] <= window_ticks <= self.window_ticks[-1])

    def is_measured_at(self, window_ticks: int) -> bool:
        """Whether windows of exactly that length were measured."""
        return bool(np.any(self.window_ticks == window_ticks))

    def accuracy(self, window_ticks: int) -> float:
        """Symbol accuracy at a window length at which the curve exists."""
        return float(self.accuracies[window_ticks])

    def trials_at(self, window_ticks: int) -> int:
        """The trials that its accuracy rests on there: those of the point, or the fewer of the two around it."""
        if self.is_measured_at(window_ticks) or len(self.window_ticks) == 1:
            return int(self.trials[np.searchsorted(self.window_ticks, window_ticks)])
        left = int(np.searchsorted(self.window_ticks, window_ticks)) - 1
        return int(self.trials[left : left + 2].min())

    @cached_property
    def log_accuracies(self) -> Floats:
        """Natural logarithms of `accuracies`, -inf where the curve does not exist or says zero."""
        with np.errstate(divide="ignore"):
            logs: Floats = np.log(np.nan_to_num(self.accuracies, nan=0.0))
        return logs

    @cached_property
    def accuracies(self) -> Floats:
        """Symbol accuracy at 0, 1, 2, ... ticks up to the longest window; nan where the curve does not exist."""
        ticks = np.arange(int(self.window_ticks[-1]) + 1)
        found = np.full(len(ticks), np.nan)
        if self.measured_only or len(self.window_ticks) == 1:
            found[self.window_ticks] = self.successes / self.trials
            return found
        within = ticks[int(self.window_ticks[0]) :]
        left, part = self.bracket(within)
        errors = self.errors
        found[within] = 1.0 - error_between(errors[left], errors[left + 1], self.floors()[left + 1], part)
        found[self.window_ticks] = self.successes / self.trials
        return found

    def bracket(self, window_ticks: Integers) -> tuple[Integers, Floats]:
        """For lengths within the range: the number of the point below, and how far on it is to the next, 0 to 1."""
        left = np.clip(
            np.searchsorted(self.window_ticks, window_ticks, side="right") - 1, 0, len(self.window_ticks) - 2
        )
        start, end = self.window_ticks[left], self.window_ticks[left + 1]
        return left, (window_ticks - start) / (end - start)

    def floors(self) -> Floats:
        """Error rates that interpolation uses where no error was seen: half an error more than none."""
        rates: Floats = 0.5 / (self.trials + 1.0)
        return rates


def fit_curve(points: Sequence[AccuracyPoint], *, measured_only: bool) -> Curve:
    """The curve through points of one channel and alphabet, by ascending window length.

    Unless `measured_only`, accuracy may only rise with the window: neighbours that fall are pooled (isotonic
    regression, weighted by trials).
    """
    ticks = np.array([point.window_ticks for point in points])
    successes = np.array([point.successes for point in points])
    trials = np.array([point.trials for point in points])
    starts = np.arange(len(points) + 1)
    if not measured_only:
        starts = isotonic_regression(successes / trials, weights=trials.astype(np.float64)).blocks
    sizes = np.diff(starts)
    blocks = np.repeat(np.arange(len(sizes)), sizes)
    right, of = (np.add.reduceat(counts, starts[:-1])[blocks] for counts in (successes, trials))
    return Curve(points[0].channel, points[0].alphabet_size, ticks, right, of, blocks, measured_only)


def error_between(left: Floats, right: Floats, floor: Floats, part: Floats) -> Floats:
    """Error rate `part` of the way from one point to the next, its logarithm interpolated.

    `floor` replaces a right end of zero, whose logarithm does not exist; errors that have ended stay ended.
    """
    end = np.where(right > 0.0, right, np.minimum(floor, left))
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.exp((1.0 - part) * np.log(left) + part * np.log(end))
    found: Floats = np.where(part <= 0.0, left, np.where(part >= 1.0, right, np.where(left > 0.0, between, 0.0)))
    return found
