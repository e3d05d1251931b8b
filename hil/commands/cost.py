"""`mtm-hil cost`: what the noise of keys costs the RoboMaster's task."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.commands.key_schemes import scheme_notes, schemes_of
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.task.cost import COLUMNS, Cost, measure_costs, rows_of
from hil.experiments.task.noise import CONDITIONS


def cost(
    keys: Sequence[Path],
    drives: int,
    seed: int,
    console: Console,
    *,
    workers: int | None,
    out: Path | None,
    cells: Path,
) -> None:
    """Drive, print and, where asked, write the table. Raises MtmError for a key whose first channel no body has."""
    schemes = schemes_of(keys)
    with CellStore(cells) as store:
        costs = measure_costs(schemes, drives, seed, store, console, workers)
    for name in schemes:
        console.print(_table(name, [cost for cost in costs if cost.scheme == name]))
    if out is not None:
        command = f"mtm-hil cost {' '.join(map(str, keys))} -n {drives} --seed {seed} --out {out}"
        write_result_csv(out, command, COLUMNS, rows_of(costs), scheme_notes(schemes))
        print(f"wrote {out}")


def _table(name: str, costs: Sequence[Cost]) -> Table:
    title = f"The RoboMaster's task under the noise of {name}, {costs[0].drives} drives"
    table = Table("", *CONDITIONS, "keyed - white (95 %)", title=title, box=None)
    for cost in costs:
        means = [f"{cost.means[condition]:.4g}" for condition in CONDITIONS]
        table.add_row(cost.measure, *means, f"{cost.more:.2g} ({cost.low:.2g} to {cost.high:.2g})")
    return table
