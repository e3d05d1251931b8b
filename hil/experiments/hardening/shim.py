"""The paper's RoboMaster message played by the microcontroller's C code, beside the same rollouts played by Python."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from hil.experiments.detectors.bench import FIRST_SEED, PAPER_SIGMA
from hil.experiments.detectors.bench_recording import Job, record
from hil.experiments.detectors.bench_rollout import job_of, plant_of, read_matched
from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.plants.mecanum import MecanumParameters
from hil.vehicles.shim_modulator import ShimModulator

PYTHON, SHIM = "python", "shim"
JOB = Job(4, 150, 1, PAPER_SIGMA)


@dataclass(frozen=True)
class Comparison:
    """Share of messages decoded from each; `same`: rollouts decoded to the same four symbols from both.

    `apart_m`: greatest distance (median over rollouts, and maximum) between a robot's positions in the two runs.
    Rounding alone moves it little, but sometimes a robot reaches a waypoint one tick earlier.
    """

    python: Proportion
    shim: Proportion
    same: Proportion
    apart_m: tuple[float, float]


def compare(
    rollouts: int, plant: MecanumParameters, store: CellStore, console: Console, workers: int | None = None
) -> Comparison:
    """The comparison over rollouts that are each run twice. Raises MtmError without a C compiler or cffi."""
    parameters = {**asdict(JOB), **asdict(plant)}
    cells = [Cell("shim", parameters, FIRST_SEED + number) for number in range(rollouts)]
    return _comparison(run_sweep(read_both, cells, store, console, workers))


def read_both(parameters: Values, seed: int) -> dict[str, Scalar]:
    """One rollout run with each of both modulators and decoded by the matched detector."""
    job, plant = job_of(parameters), plant_of(parameters)
    python, shim = record(job, plant, seed), record(job, plant, seed, ShimModulator)
    decided = {PYTHON: read_matched(job, python), SHIM: read_matched(job, shim)}
    apart_m = max(
        float(np.max(np.abs(one.displacements - other.displacements)))
        for one, other in zip(python.seen, shim.seen, strict=True)
    )
    return {
        **{name: bool(np.array_equal(symbols, python.symbols)) for name, symbols in decided.items()},
        "same": bool(np.array_equal(decided[PYTHON], decided[SHIM])),
        "apart_m": apart_m,
    }


def _comparison(results: Sequence[Values]) -> Comparison:
    def share(name: str) -> Proportion:
        return Proportion(sum(bool(result[name]) for result in results), len(results))

    apart_m = [float(result["apart_m"]) for result in results]
    return Comparison(share(PYTHON), share(SHIM), share("same"), (float(np.median(apart_m)), max(apart_m)))


def write_csv(path: Path, comparison: Comparison, command: str, notes: Sequence[str]) -> None:
    """Write the three shares under the command line and the notes."""
    shares = {PYTHON: comparison.python, SHIM: comparison.shim, "same symbols from both": comparison.same}
    columns = ("played_by", "message_ticks", "rollouts", "messages", "percent", "percent_low", "percent_high")
    write_result_csv(path, command, columns, [_csv_row(name, share) for name, share in shares.items()], notes)


def _csv_row(name: str, share: Proportion) -> tuple[object, ...]:
    return name, JOB.window_ticks, share.trials, share.successes, *share.figures
