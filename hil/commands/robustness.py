"""`mtm-hil robustness`: the matched detector under uncalibrated cameras, frame times and clocks."""

from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from hil.experiments.detectors.robustness import CONDITIONS, JOBS, read_under
from hil.experiments.runs.cells import Cell, CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = (
    "alphabet_size", "ticks", "windows", "condition", "rollouts", "symbols", "right", "accuracy", "low", "high",
)  # fmt: skip


def robustness(rollouts: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write symbol accuracy under each condition, on the same rollouts."""
    rows: list[tuple[object, ...]] = []
    with CellStore(cells) as store:
        for job in JOBS:
            print(f"M = {job.alphabet_size}, T = {job.ticks}, {job.windows} symbols a robot, {rollouts} rollouts")
            for name in CONDITIONS:
                asked = [Cell("robustness", {"condition": name, **asdict(job)}, seed + row) for row in range(rollouts)]
                results = run_sweep(read_under, asked, store, console, workers)
                read, right = (sum(int(result[field]) for result in results) for field in ("read", "right"))
                low, high = clopper_pearson(right, read)
                interval = f"{100 * low:.2f}-{100 * high:.2f}"
                print(f"{name:40s} {100 * right / read:6.2f} % of {read} symbols, 95 % interval {interval}")
                accuracy = [f"{value:.5f}" for value in (right / read, low, high)]
                rows.append((job.alphabet_size, job.ticks, job.windows, name, rollouts, read, right, *accuracy))
    if out is not None:
        write_result_csv(out, f"mtm-hil robustness -n {rollouts} --seed {seed} --out {out}", _COLUMNS, rows)
        print(f"wrote {out}")
