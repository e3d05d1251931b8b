"""What a scheme's noise costs the RoboMaster's task, beside white noise of the same standard deviations."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields

import numpy as np
from rich.console import Console
from scipy import stats

from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.task.drive import Drive, drive
from hil.experiments.task.noise import CLEAN, CONDITIONS, KEYED, WHITE
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Scheme
from mtm_onboard.protocol.scheme import scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

MEASURES = tuple(field.name for field in fields(Drive))
# Drives in one cell.
_BATCH = 10
_LEVEL = 0.95


@dataclass(frozen=True, kw_only=True)
class Cost:
    """One measure of the drives under one scheme: means by condition, and what keyed noise has more than white.

    `more` is the mean of the differences drive by drive, and `low` to `high` its 95 % interval (Student's t).
    """

    scheme: str
    measure: str
    drives: int
    means: Mapping[str, float]
    more: float
    low: float
    high: float


def drive_batch(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Each measure of the drives of `seed` and the seeds after it, in the order of the seeds, under "<measure> <n>"."""
    scheme = scheme_from_table(tomllib.loads(str(parameters["scheme"]))["scheme"])
    found: dict[str, Scalar] = {}
    for number in range(int(parameters["drives"])):
        driven = drive(scheme, str(parameters["condition"]), seed + number)
        found |= {f"{name} {number}": value for name, value in asdict(driven).items()}
    return found


def measure_costs(
    schemes: Mapping[str, Scheme], drives: int, first_seed: int, store: CellStore, console: Console, workers: int | None
) -> list[Cost]:
    """The costs under each scheme, by its name, of the same drives under each condition; at least two drives."""
    asked = [
        (name, condition, _cell(scheme, condition, first_seed + first, min(_BATCH, drives - first)))
        for name, scheme in schemes.items()
        for condition in CONDITIONS
        for first in range(0, drives, _BATCH)
    ]
    results = run_sweep(drive_batch, [cell for *_, cell in asked], store, console, workers)
    gathered: dict[tuple[str, str, str], list[float]] = {}
    for (name, condition, cell), result in zip(asked, results, strict=True):
        for what in MEASURES:
            values = [float(result[f"{what} {number}"]) for number in range(int(cell.parameters["drives"]))]
            gathered.setdefault((name, what, condition), []).extend(values)
    return [
        _cost(name, what, {condition: np.array(gathered[name, what, condition]) for condition in CONDITIONS})
        for name in schemes
        for what in MEASURES
    ]


def _cost(name: str, what: str, values: Mapping[str, Floats]) -> Cost:
    differences = values[KEYED] - values[WHITE]
    more, error = float(np.mean(differences)), float(stats.sem(differences))
    half = error * float(stats.t.ppf(0.5 + _LEVEL / 2.0, len(differences) - 1))
    means = {condition: float(np.mean(values[condition])) for condition in CONDITIONS}
    return Cost(scheme=name, measure=what, drives=len(differences), means=means, more=more, low=more - half,
                high=more + half)  # fmt: skip


def _cell(scheme: Scheme, condition: str, seed: int, drives: int) -> Cell:
    return Cell("task cost", {"scheme": scheme_text(scheme), "condition": condition, "drives": drives}, seed)


COLUMNS = ("scheme", "measure", "drives", CLEAN, WHITE, KEYED, "keyed_minus_white", "low", "high")


def rows_of(costs: Sequence[Cost]) -> list[tuple[object, ...]]:
    """The lines of a table with `COLUMNS`."""
    return [
        (cost.scheme, cost.measure, cost.drives, *(f"{cost.means[name]:.5g}" for name in CONDITIONS),
         f"{cost.more:.3g}", f"{cost.low:.3g}", f"{cost.high:.3g}")
        for cost in costs
    ]  # fmt: skip
