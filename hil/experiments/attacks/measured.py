"""From cells to one row for each reader, arm and level of an attack."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich.console import Console

from hil.experiments.attacks.attack import DISTANCE, DISTORTION, FORETOLD, MARGIN, RIGHT, TRIALS, Attack, PaperFigure
from hil.experiments.attacks.registry import measure_attack
from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.worlds.reading import COHERENCY

_PAPER_TRIALS = 400


@dataclass(frozen=True, kw_only=True)
class Row:
    """What one reader has right at one level of one arm, and what the attack does there.

    `distance_percent` is against the arm's first level; what was not measured is None.
    """

    attack: Attack
    arm: str
    level: float
    reader: str
    right: Proportion
    margin: float | None
    distortion_percent: float | None
    distance_percent: float | None
    foretold: float | None

    @property
    def paper(self) -> PaperFigure | None:
        """The paper's figures at this level."""
        return (self.attack.paper or {}).get((self.arm, self.level))

    @property
    def against_the_paper(self) -> str:
        """`higher` or `lower` when coherency's interval and that of the paper's 400 messages do not overlap."""
        if self.paper is None or self.reader != COHERENCY:
            return ""
        low, high = self.right.interval_percent
        paper = clopper_pearson(round(self.paper.percent / 100.0 * _PAPER_TRIALS), _PAPER_TRIALS)
        if low > 100.0 * paper[1]:
            return "higher"
        return "lower" if high < 100.0 * paper[0] else "agrees"


def cells_of(attack: Attack, rollouts: int, first_seed: int) -> list[Cell]:
    """All cells of an attack; every level has the same rollouts."""
    count = max(1, round(rollouts * attack.share))
    return [
        Cell("attacks", {"attack": attack.name, "arm": arm, "level": level,
                         "rollouts": min(attack.batch, count - begun)}, first_seed + begun)
        for arm, levels in attack.levels.items()
        for level in levels
        for begun in range(0, count, attack.batch)
    ]  # fmt: skip


def measured(
    attack: Attack, rollouts: int, first_seed: int, store: CellStore, console: Console, workers: int | None
) -> list[Row]:
    """Compute what is missing and tabulate it."""
    cells = cells_of(attack, rollouts, first_seed)
    return rows_of(attack, cells, run_sweep(measure_attack, cells, store, console, workers))


def rows_of(attack: Attack, cells: Sequence[Cell], results: Sequence[Values]) -> list[Row]:
    """Rows in the order of arms and levels."""
    return [row for arm in attack.levels for row in _rows_of_arm(attack, arm, cells, results)]


def _rows_of_arm(attack: Attack, arm: str, cells: Sequence[Cell], results: Sequence[Values]) -> Iterator[Row]:
    first_distance: float | None = None
    for level in attack.levels[arm]:
        own = [
            result
            for cell, result in zip(cells, results, strict=True)
            if (cell.parameters["arm"], cell.parameters["level"]) == (arm, level)
        ]
        distance = _mean(own, DISTANCE)
        first_distance = distance if first_distance is None else first_distance
        change = None if distance is None or first_distance is None else 100.0 * (distance / first_distance - 1.0)
        distortion = _mean(own, DISTORTION)
        for reader in [name.removesuffix(f" {TRIALS}") for name in own[0] if name.endswith(f" {TRIALS}")]:
            counts = [sum(int(result[f"{reader} {what}"]) for result in own) for what in (RIGHT, TRIALS)]
            yield Row(
                attack=attack,
                arm=arm,
                level=level,
                reader=reader,
                right=Proportion(*counts),
                margin=_mean(own, f"{reader} {MARGIN}"),
                distortion_percent=None if distortion is None else 100.0 * distortion,
                distance_percent=change,
                foretold=_mean(own, FORETOLD),
            )


def _mean(results: Sequence[Values], name: str) -> float | None:
    """The mean over cells, which hold equally many rollouts or nearly so."""
    values = [float(result[name]) for result in results if name in result]
    return sum(values) / len(values) if values else None
