"""The paper's tables of a simulated world, measured here.

Its appendices "Discovery", "Lunar Lander", "Reacher" and "Football: Numerical Results" (tab:discovery-single-x to
tab:football-indep) and "Null Conditions" (tab:null).
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from scipy.stats import fisher_exact

from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.worlds.genie import GENIE
from hil.experiments.worlds.points import HEADLINES, PaperEntry, Point, headline_point, paper_entries
from hil.experiments.worlds.reading import COHERENCY, MATCHED
from hil.experiments.worlds.rollout import (
    FILE,
    MEMORY,
    NO_MESSAGE,
    SECONDS,
    SENT,
    SOFTWARE,
    decode_batch,
    rollout_parameters,
)

DETECTORS = (COHERENCY, MATCHED)
_SIGNIFICANT = 0.05
WRONG_KEY = "wrong key"
THROUGH_A_FILE = "from a file"
# Rollouts that one process takes at once: enough for a simulator that steps them together, few enough to be stopped.
_BATCH = {"discovery": 10, "lunar-lander": 2, "reacher": 2, "football": 32}
# Wrong keys that try each rollout; each of Football's costs as much as its film.
_DECOYS = {"discovery": 5, "lunar-lander": 5, "reacher": 5, "football": 1}
# Channels that are read from the recordings of "same" as well, since there each body or axis moves by itself.
_PARTS = {"discovery": ("x",), "football": ("agent0",)}


@dataclass(frozen=True)
class Effort:
    """How much to measure, from `first_seed` on.

    Rollouts at the headline point, at shorter messages of its scheme and without a message, and at all other points.
    `quick` leaves the headline point alone, with the shortest messages of the largest alphabet beside it.
    """

    headline_rollouts: int
    compared_rollouts: int
    other_rollouts: int
    first_seed: int
    renderer: str = SOFTWARE
    quick: bool = False


@dataclass(frozen=True)
class Condition:
    """What is recorded and how it is read; `arm`, `decoys` and `medium` are what differs from a plain rollout."""

    point: Point
    rollouts: int
    detectors: tuple[str, ...] = DETECTORS
    arm: str = SENT
    decoys: int = 0
    medium: str = MEMORY


@dataclass(frozen=True, kw_only=True)
class Row:
    """What one detector has right at one point.

    `arm` is what was sent and tried; `goals` are whole messages, None in the null conditions, `symbols` single ones;
    `paper` is None where the paper has no such point.
    """

    arm: str
    point: Point
    detector: str
    rollouts: int
    goals: Proportion | None
    symbols: Proportion
    margin: float | None = None
    paper: PaperEntry | None = None


def conditions_of(world: str, effort: Effort) -> list[Condition]:
    """What to record in a world: the paper's points, shorter messages, and the headline point in special ways."""
    headline = headline_point(world)
    points = [cell.point for cell in paper_entries(world) if cell.point.arrangement not in _PARTS.get(world, ())]
    shorter = [headline_point(world, ticks) for ticks in HEADLINES[world].shorter_ticks]
    if effort.quick:
        shortest = min(point.message_ticks for point in points)
        points, shorter = [headline_point(world, shortest)], []
    # As many goals at each point, whether a rollout has several or one.
    rollouts = {point: effort.other_rollouts * headline.goals // point.goals for point in points}
    rollouts |= dict.fromkeys(shorter, effort.compared_rollouts)
    rollouts[headline] = effort.headline_rollouts
    compared = {*shorter, headline}
    found = [
        Condition(
            point, count, (*DETECTORS, GENIE) if point in compared else DETECTORS,
            decoys=_DECOYS[world] if point == headline else 0,
        )
        for point, count in rollouts.items()
    ]  # fmt: skip
    found.append(Condition(headline, effort.compared_rollouts, arm=NO_MESSAGE))
    found.append(Condition(headline, min(_BATCH[world], effort.headline_rollouts), medium=FILE))
    return found


def null_conditions_of(world: str, effort: Effort) -> list[Condition]:
    """The headline point, with wrong keys and without a message."""
    return [condition for condition in conditions_of(world, effort) if condition.decoys or condition.arm == NO_MESSAGE]


def measure(
    world: str,
    effort: Effort,
    conditions: Sequence[Condition],
    store: CellStore,
    console: Console,
    workers: int | None = None,
) -> tuple[list[Row], float]:
    """The rows of a world under the conditions, and the processor time, seconds, that all cells took."""
    groups = [_cells(world, condition, effort) for condition in conditions]
    results = run_sweep(decode_batch, [cell for group in groups for cell in group], store, console, workers)
    taken = iter(results)
    rows: list[Row] = []
    for condition, group in zip(conditions, groups, strict=True):
        rows += _rows(world, condition, _joined([next(taken) for _ in group]))
    return rows, sum(float(result[SECONDS]) for result in results)


def shortest_ticks(rows: Sequence[Row], detector: str) -> int | None:
    """The shortest message of the headline's scheme that a detector reads as well as the paper's reads the headline.

    As well: not significantly fewer right (Fisher's exact test at 5 %), at this length and at all longer ones.
    """
    headline = headline_point(rows[0].point.world)
    sent = {
        (row.point.message_ticks, row.detector): row.goals
        for row in rows
        if row.arm == SENT and row.goals is not None
        and row.point == replace(headline, message_ticks=row.point.message_ticks)
    }  # fmt: skip
    asked = sent[headline.message_ticks, COHERENCY]
    shortest = None
    for ticks in sorted((ticks for ticks, name in sent if name == detector), reverse=True):
        if ticks > headline.message_ticks:
            continue
        own = sent[ticks, detector]
        table = [[own.successes, own.trials - own.successes], [asked.successes, asked.trials - asked.successes]]
        if fisher_exact(np.array(table), alternative="less").pvalue < _SIGNIFICANT:
            break
        shortest = ticks
    return shortest


def _cells(world: str, condition: Condition, effort: Effort) -> list[Cell]:
    size = _BATCH[world]
    parts = _PARTS.get(world, ()) if condition.point.arrangement == "same" else ()
    return [
        Cell(
            "worlds",
            rollout_parameters(
                condition.point, min(size, condition.rollouts - first), condition.detectors, arm=condition.arm,
                decoys=condition.decoys, parts=parts, renderer=effort.renderer, medium=condition.medium,
            ),
            effort.first_seed + first,
        )
        for first in range(0, condition.rollouts, size)
    ]  # fmt: skip


def _joined(results: Sequence[Values]) -> dict[str, list[float]]:
    """The lists of all batches, one after the other."""
    names = [name for name in results[0] if name != SECONDS]
    return {name: [value for result in results for value in json.loads(str(result[name]))] for name in names}


def _rows(world: str, condition: Condition, results: dict[str, list[float]]) -> Iterator[Row]:
    recorded = condition.point
    paper = {cell.point: cell for cell in paper_entries(world)}
    arm = THROUGH_A_FILE if condition.medium == FILE else condition.arm
    for name in [name for name in results if name.endswith(" goals")]:
        detector, arrangement, _ = name.split(" ")
        point = recorded.of_arrangement(arrangement)
        own = {what: results[f"{detector} {arrangement} {what}"] for what in ("goals", "symbols", "margin")}
        trials = condition.rollouts * point.goals
        symbols = Proportion(int(sum(own["symbols"])), trials * point.goal_symbols)
        margin = sum(own["margin"]) / condition.rollouts
        if condition.arm == NO_MESSAGE:
            yield Row(arm=arm, point=point, detector=detector, rollouts=condition.rollouts, goals=None, symbols=symbols)
            continue
        goals = Proportion(int(sum(own["goals"])), trials)
        reported = paper.get(point) if arm == SENT else None
        yield Row(
            arm=arm,
            point=point,
            detector=detector,
            rollouts=condition.rollouts,
            goals=goals,
            symbols=symbols,
            margin=margin,
            paper=reported,
        )
        if f"{detector} {arrangement} wrong" in results:
            wrong = int(sum(results[f"{detector} {arrangement} wrong"]))
            tried = Proportion(wrong, symbols.trials * condition.decoys)
            yield Row(
                arm=WRONG_KEY, point=point, detector=detector, rollouts=condition.rollouts, goals=None, symbols=tried
            )
