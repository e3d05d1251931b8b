"""`mtm-hil bench --plants`: the family of simulated robots, read by two detectors and the linear genie."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hil.experiments.plants.rollout import DETECTORS, PlantJob, plant_cells, read_plant
from hil.experiments.runs.cells import CellStore, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.worlds.vehicles import VEHICLES, vehicle

ALL = "all"
_VERDICTS = ("decoded", "inconclusive", "absent", "refused")
_COLUMNS = (
    "plant", "axes", "alphabet_size", "ticks", "windows", "sigma", "rollouts", "symbols",
    *(f"{detector}{end}" for detector in DETECTORS for end in ("", "_low", "_high")), *_VERDICTS, "decoded_wrong",
    "bits_median",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PlantsOptions:
    """What the command line asked for; `plants` are names of the family, parted by commas, or all of them."""

    plants: str
    job: PlantJob
    rollouts: int
    out: Path | None
    cells: Path


@dataclass(frozen=True)
class PlantRow:
    """What was read of one kind of robot: symbols by detector, verdicts of `matched`, and the median evidence."""

    plant: str
    symbols: dict[str, Proportion]
    verdicts: dict[str, int]
    wrong: int
    bits: float


def bench_plants(options: PlantsOptions, console: Console) -> None:
    """Measure, print and, where asked, write the table; raises MtmError for a plant that is not known."""
    names = list(VEHICLES) if options.plants == ALL else [name.strip() for name in options.plants.split(",")]
    for name in names:
        options.job.scheme(vehicle(name).kind.axes)
    rows = []
    with CellStore(options.cells) as store:
        for name in names:
            results = run_sweep(read_plant, plant_cells(name, options.job, options.rollouts), store, console)
            rows.append(summarise_plant(name, options.job, results))
    console.print(_table(rows, options))
    if options.out is not None:
        write_result_csv(options.out, _command(options), _COLUMNS, [_csv_row(row, options) for row in rows])
        print(f"wrote {options.out}")


def summarise_plant(name: str, job: PlantJob, results: Sequence[Values]) -> PlantRow:
    """Collect the rollouts of one kind."""
    trials = job.windows * len(results)
    verdicts = [str(result["verdict"]) for result in results]
    return PlantRow(
        plant=name,
        symbols={own: Proportion(sum(int(result[own]) for result in results), trials) for own in DETECTORS},
        verdicts={verdict: verdicts.count(verdict) for verdict in _VERDICTS},
        wrong=sum(bool(result["wrong"]) for result in results),
        bits=float(np.median([float(result["bits"]) for result in results])),
    )


def _table(rows: Sequence[PlantRow], options: PlantsOptions) -> Table:
    job = options.job
    table = Table(
        title=f"symbols right in % [95 % interval]: M = {job.alphabet_size}, T = {job.ticks}, {job.windows} symbols, "
        f"sigma {job.sigma:g}, onset known; verdicts of matched",
        box=None, padding=(0, 1, 0, 0), pad_edge=False,
    )  # fmt: skip
    table.add_column("plant", no_wrap=True)
    for name in ("symbols", *DETECTORS, "decoded", "wrong", "unsure", "absent", "bits"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        shares = [str(row.symbols[detector]) for detector in DETECTORS]
        counts = (row.verdicts["decoded"], row.wrong, row.verdicts["inconclusive"],
                  row.verdicts["absent"] + row.verdicts["refused"])  # fmt: skip
        table.add_row(
            Path(row.plant).stem, str(row.symbols["genie"].trials), *shares, *map(str, counts), f"{row.bits:.1f}"
        )
    return table


def _csv_row(row: PlantRow, options: PlantsOptions) -> tuple[object, ...]:
    job = options.job
    shares: list[object] = []
    for detector in DETECTORS:
        share = row.symbols[detector]
        shares += share.figures
    return (
        Path(row.plant).name, " ".join(vehicle(row.plant).kind.axes),
        job.alphabet_size, job.ticks, job.windows, job.sigma,
        options.rollouts, row.symbols["genie"].trials, *shares, *row.verdicts.values(), row.wrong, f"{row.bits:.2f}",
    )  # fmt: skip


def _command(options: PlantsOptions) -> str:
    out = "" if options.out is None else f" --out {options.out}"
    return f"mtm-hil bench --plants {options.plants} --ticks {options.job.ticks} --rollouts {options.rollouts}{out}"
