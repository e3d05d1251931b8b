"""Exact confidence intervals of proportions."""

from scipy.stats import binomtest


def clopper_pearson(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Lower and upper end of the exact (Clopper-Pearson) interval, 0 to 1.

    Raises ValueError unless 0 <= successes <= trials and trials is at least 1.
    """
    interval = binomtest(successes, trials).proportion_ci(confidence, method="exact")
    return float(interval.low), float(interval.high)
