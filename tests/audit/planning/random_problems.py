"""Planning problems whose truth is known, to see whether predictions hold on messages that no table has seen.

`python -m tests.audit.planning.random_problems 200` prints the share over many problems.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hil.experiments.runs.intervals import clopper_pearson
from mtm_audit.planning.plan import Plan, Problem
from mtm_audit.planning.report import fastest
from mtm_audit.planning.search import search
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable
from mtm_onboard.protocol import MtmError

_HELD_OUT_MESSAGES = 400
_NAMES = ("a", "b", "c", "d")


@dataclass(frozen=True)
class Outcome:
    """A plan, the accuracy that its scheme really has, and the interval of held-out messages."""

    plan: Plan
    truth: float
    held_out: tuple[float, float]

    @property
    def agrees(self) -> bool:
        """Whether the predicted and the measured interval overlap."""
        return self.plan.interval[0] <= self.held_out[1] and self.held_out[0] <= self.plan.interval[1]

    @property
    def covers(self) -> bool:
        """Whether the truth lies in the predicted interval."""
        return self.plan.interval[0] <= self.truth <= self.plan.interval[1]


def random_outcome(seed: int, *, measured_only: bool = False) -> Outcome:
    """Draw a world, measure it, plan on the measurements, and send held-out messages under the plan."""
    generator = np.random.default_rng(seed)
    while True:
        curves, table = _world(generator)
        problem = Problem(
            int(generator.integers(4, 17)), float(generator.uniform(0.7, 0.97)), measured_only=measured_only
        )
        try:
            plan = fastest(search(table, problem))
        except MtmError:
            continue  # out of reach of this world; draw another
        truth = float(
            np.prod(
                [
                    curves[curve.channel, plan.alphabet_size](plan.message_ticks // count) ** count
                    for curve, count in plan.parts
                ]
            )
        )
        right = int(generator.binomial(_HELD_OUT_MESSAGES, truth))
        return Outcome(plan, truth, clopper_pearson(right, _HELD_OUT_MESSAGES))


def _world(
    generator: np.random.Generator,
) -> tuple[dict[tuple[str, int], Callable[[float], float]], AccuracyTable]:
    """Accuracies that rise from chance to a plateau, sharply or slowly, and a table sampled from them."""
    names = _NAMES[: generator.integers(2, 5)]
    ticks = 20 * np.arange(1, generator.integers(7, 14))
    trials = int(generator.integers(100, 800))
    curves, points = {}, []
    for alphabet in (2, 4, 16):
        for name in names:
            curve = _curve(generator, alphabet)
            curves[name, alphabet] = curve
            for t in ticks:
                right = int(generator.binomial(trials, curve(float(t))))
                points.append(AccuracyPoint(name, alphabet, int(t), right, trials))
    return curves, AccuracyTable(tuple(points))


def _curve(generator: np.random.Generator, alphabet: int) -> Callable[[float], float]:
    scale, sharpness = generator.uniform(25.0, 90.0), generator.uniform(0.9, 2.2)
    plateau = float(generator.choice([0.0, 0.002, 0.01]))

    def accuracy(ticks: float) -> float:
        return 1.0 - plateau - (1.0 - 1.0 / alphabet - plateau) * float(np.exp(-((ticks / scale) ** sharpness)))

    return accuracy


def main(count: int) -> None:
    """Print how many of `count` problems agree, and how many intervals cover the truth."""
    for measured_only in (False, True):
        outcomes = [random_outcome(seed, measured_only=measured_only) for seed in range(count)]
        off = np.array([outcome.plan.accuracy - outcome.truth for outcome in outcomes])
        widths = np.array([np.ptp(outcome.plan.interval) for outcome in outcomes])
        print(
            f"{'measured points' if measured_only else 'interpolated'}: {count} problems, "
            f"{sum(outcome.agrees for outcome in outcomes)} agree, "
            f"{sum(outcome.covers for outcome in outcomes)} intervals cover the truth; prediction minus truth "
            f"{off.mean():+.4f} on average, {np.sqrt(np.mean(off**2)):.4f} rms, median interval {np.median(widths):.3f}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]))
