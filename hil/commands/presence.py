"""`mtm-hil presence`: is a key's noise seen in the motion by somebody without it."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.commands.key_schemes import scheme_notes, schemes_of
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.task.presence import Presence, measure_presence
from hil.worlds.vehicles import arena_task

_COLUMNS = ("scheme", "plant", "against", "reader", "seconds", "pairs", "right", "percent", "low", "high")


def presence(
    keys: Sequence[Path],
    plant: str,
    drives: int,
    seed: int,
    console: Console,
    *,
    workers: int | None,
    out: Path | None,
    cells: Path,
) -> None:
    """Drive, print and, where asked, write the table. Raises MtmError for a key that moves no body on its axes."""
    arena_task(plant)
    schemes = schemes_of(keys)
    with CellStore(cells) as store:
        rows = measure_presence(schemes, plant, drives, seed, store, console, workers=workers)
    console.print(_table(rows))
    if out is not None:
        command = f"mtm-hil presence {' '.join(map(str, keys))} --plant {plant} -n {drives} --seed {seed} --out {out}"
        notes = (
            *scheme_notes(schemes),
            "right: pairs ranked rightly (AUC); by chance 50 %",
        )
        write_result_csv(out, command, _COLUMNS, map(_line, rows), notes)
        print(f"wrote {out}")


def _line(row: Presence) -> tuple[object, ...]:
    ranked = row.ranked
    return (row.scheme, row.plant, row.against, row.reader, f"{row.seconds:g}", ranked.trials, ranked.successes,
            *ranked.figures)  # fmt: skip


def _table(rows: Sequence[Presence]) -> Table:
    title = "Drives with a message told from others without the key: AUC in percent, exact 95 % intervals"
    table = Table(title=title, box=None)
    for name in ("scheme", "plant", "against", "reader", "s", "AUC"):
        table.add_column(name, no_wrap=True)
    for row in rows:
        table.add_row(row.scheme, row.plant, row.against, row.reader, f"{row.seconds:g}", str(row.ranked))
    return table
