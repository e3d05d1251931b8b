"""The benchmark: the paper's detector, the matched one and the genie (the oracle) on the same recordings.

Two jobs: the paper's (one 2-bit symbol a robot) over the window length, and sustained sending (eight symbols in a row
of a larger alphabet); both at one window length over sigma as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rich.console import Console

from hil.experiments.detectors.bench_recording import Job
from hil.experiments.detectors.bench_rollout import COHERENCY, GENIE, MATCHED, read_rollout, rollout_parameters
from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.plants.mecanum import MecanumParameters
from hil.worlds.robomaster import ROBOTS

DETECTORS = (COHERENCY, MATCHED, GENIE)
# Reported seeds count from here; detectors were developed on seeds below 10 000.
FIRST_SEED = 100_000
PAPER_SIGMA = 0.1

_QUICK_ROLLOUTS = 3
_PAPER, _SUSTAINED = Job(4, 150, 1, PAPER_SIGMA), Job(256, 100, 8, PAPER_SIGMA)
_TICKS = (100, 150, 200, 50, 75, 125, 300, 400, 600)
_PAPER_SIGMAS = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
_SUSTAINED_SIGMAS = (0.05, 0.06, 0.07, 0.085, 0.12, 0.14)


@dataclass(frozen=True)
class Condition:
    """A job, how many rollouts of it, and how many of those the paper's detector reads as well."""

    job: Job
    rollouts: int
    coherency_rollouts: int


@dataclass(frozen=True)
class Row:
    """One detector's correct symbols and messages in one job; a message is all that the robots of a rollout send."""

    job: Job
    detector: str
    rollouts: int
    symbols: Proportion
    messages: Proportion


def conditions(rollouts: int) -> list[Condition]:
    """All conditions, the most informative first; the paper's detector reads a tenth of the slow ones."""
    tenth = -(-rollouts // 10)
    over_ticks = [Condition(replace(_PAPER, window_ticks=ticks), rollouts, rollouts) for ticks in _TICKS]
    return [
        *over_ticks[:3],
        Condition(_SUSTAINED, rollouts, tenth),
        *over_ticks[3:],
        *(Condition(replace(_PAPER, sigma=sigma), rollouts, rollouts) for sigma in _PAPER_SIGMAS),
        Condition(Job(16, 50, 8, PAPER_SIGMA), rollouts, tenth),
        *(Condition(replace(_SUSTAINED, sigma=sigma), rollouts, 0) for sigma in _SUSTAINED_SIGMAS),
        Condition(Job(1024, 100, 8, PAPER_SIGMA), rollouts, tenth),
    ]


def quick_conditions() -> list[Condition]:
    """A few conditions of each kind, which take seconds."""
    jobs = (_PAPER, replace(_PAPER, window_ticks=300), replace(_PAPER, sigma=0.04), Job(16, 50, 4, PAPER_SIGMA))
    return [Condition(job, _QUICK_ROLLOUTS, _QUICK_ROLLOUTS) for job in jobs]


def measure(
    asked: Sequence[Condition],
    plant: MecanumParameters,
    store: CellStore,
    console: Console,
    *,
    silences: int,
    workers: int | None = None,
) -> list[Row]:
    """The rows of all detectors under the conditions; the genie's interference is fitted to `silences` recordings."""
    groups = [
        [_cell(condition, plant, silences, number) for number in range(condition.rollouts)] for condition in asked
    ]
    results = iter(run_sweep(read_rollout, [cell for group in groups for cell in group], store, console, workers))
    rows: list[Row] = []
    for condition in asked:
        found = [next(results) for _ in range(condition.rollouts)]
        rows += [row for name in DETECTORS if (row := _row(condition.job, name, found)) is not None]
    return rows


def _cell(condition: Condition, plant: MecanumParameters, silences: int, number: int) -> Cell:
    coherency = number < condition.coherency_rollouts
    return Cell("bench", rollout_parameters(condition.job, plant, silences, coherency=coherency), FIRST_SEED + number)


def _row(job: Job, detector: str, results: Sequence[Values]) -> Row | None:
    correct = [int(result[detector]) for result in results if detector in result]
    if not correct:
        return None
    each = ROBOTS * job.windows
    whole = sum(count == each for count in correct)
    return Row(
        job, detector, len(correct), Proportion(sum(correct), each * len(correct)), Proportion(whole, len(correct))
    )
