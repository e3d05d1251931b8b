"""What sampling error of an accuracy table leaves open about a message's accuracy."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import beta

from mtm_audit.model.track import Floats
from mtm_audit.planning.curve import Curve, error_between

CONFIDENCE = 0.95
_DRAWS = 2048
_SEED = 1

# A curve, a window length, and how many symbols are sent in such windows.
Part = tuple[Curve, int, int]


def message_interval(parts: Sequence[Part], confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Lower and upper end for the product of the parts' symbol accuracies, 0 to 1.

    Each count has two confidence distributions, Beta(s, n - s + 1) for the lower end and Beta(s + 1, n - s) for the
    upper, and the ends are quantiles of the product over draws from them. With a single measured point that is the
    exact (Clopper-Pearson) interval; with several it is on the safe side. Between points the lower end takes the
    straight line between accuracies, and the upper end the line between logarithms of the error: the one is too low
    and the other too high for errors that fall ever faster, and then slow down.
    """
    generator = np.random.default_rng(_SEED)
    low, high = np.zeros(_DRAWS), np.zeros(_DRAWS)
    with np.errstate(divide="ignore"):
        for curve, window_ticks, symbols in parts:
            lower, upper = _draws(curve, window_ticks, generator)
            low += symbols * np.log(lower)
            high += symbols * np.log(upper)
    tail = (1.0 - confidence) / 2.0
    ends = _quantile(np.exp(low), tail), _quantile(np.exp(high), 1.0 - tail)
    return min(ends), max(ends)


def _quantile(values: Floats, share: float) -> float:
    # The draws are the middles of equal strata, for which this method is the exact one.
    return float(np.quantile(values, share, method="hazen"))


def _draws(curve: Curve, window_ticks: int, generator: np.random.Generator) -> tuple[Floats, Floats]:
    """Accuracies of one window for the lower and for the upper end, (draws,) each."""
    exact = np.flatnonzero(curve.window_ticks == window_ticks)
    if len(exact):
        return _at_point(curve, int(exact[0]), generator)
    places, shares = curve.bracket(np.array([window_ticks]))
    left, part = int(places[0]), np.full(_DRAWS, shares[0])
    if curve.blocks[left] == curve.blocks[left + 1]:
        return _at_point(curve, left, generator)
    lower_left, upper_left = _at_point(curve, left, generator)
    lower_right, upper_right = _at_point(curve, left + 1, generator)
    lower = (1.0 - part) * lower_left + part * np.maximum(lower_left, lower_right)
    floor = np.full(_DRAWS, curve.floors()[left + 1])
    upper = 1.0 - error_between(1.0 - upper_left, np.minimum(1.0 - upper_left, 1.0 - upper_right), floor, part)
    return lower, upper


def _at_point(curve: Curve, place: int, generator: np.random.Generator) -> tuple[Floats, Floats]:
    right, wrong = int(curve.successes[place]), int(curve.trials[place] - curve.successes[place])
    levels = (generator.permutation(_DRAWS) + 0.5) / _DRAWS
    lower = beta.ppf(levels, right, wrong + 1) if right else np.zeros(_DRAWS)
    upper = beta.ppf(levels, right + 1, wrong) if wrong else np.ones(_DRAWS)
    return lower, upper
