"""`mtm-hil cost`: what the noise of keys costs the RoboMaster's task."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.task.cost import COLUMNS, measure_costs, rows_of
from mtm_onboard.protocol import MtmError, load_key


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
    schemes = {key.id: key.scheme for key in map(load_key, keys)}
    if len(schemes) < len(keys):
        raise MtmError("two of the keys have one name; make them with different --id")
    with CellStore(cells) as store:
        costs = measure_costs(schemes, drives, seed, store, console, workers)
    table = Table(*COLUMNS, title=f"The RoboMaster's task under the noise of keys, {drives} drives", box=None)
    for row in rows_of(costs):
        table.add_row(*map(str, row))
    console.print(table)
    if out is not None:
        command = f"mtm-hil cost {' '.join(map(str, keys))} -n {drives} --seed {seed} --out {out}"
        notes = tuple(f"{name}: scheme {scheme.fingerprint}" for name, scheme in schemes.items())
        write_result_csv(out, command, COLUMNS, rows_of(costs), notes)
        print(f"wrote {out}")
