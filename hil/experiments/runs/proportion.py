"""A share that was counted, with its exact confidence interval."""

from dataclasses import dataclass

from hil.experiments.runs.intervals import clopper_pearson


@dataclass(frozen=True)
class Proportion:
    """Successes out of trials."""

    successes: int
    trials: int

    @property
    def percent(self) -> float:
        """100 times the share of successes."""
        return 100.0 * self.successes / self.trials

    @property
    def interval_percent(self) -> tuple[float, float]:
        """Exact 95 % interval, which takes the trials for independent."""
        low, high = clopper_pearson(self.successes, self.trials)
        return 100.0 * low, 100.0 * high

    @property
    def figures(self) -> tuple[str, str, str]:
        """The percentage and its interval as tables of results have them, to two decimals."""
        low, high = self.interval_percent
        return f"{self.percent:.2f}", f"{low:.2f}", f"{high:.2f}"

    def __str__(self) -> str:
        low, high = self.interval_percent
        return f"{self.percent:.1f} [{low:.0f}-{high:.0f}]"
