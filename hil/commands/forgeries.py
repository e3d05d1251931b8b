"""`mtm-hil forgeries`: forgers against keys as they are made by default."""

from pathlib import Path

from rich.console import Console

from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.verdicts.forgeries import ATTACKS, COUNTS, HONEST, forgery_cells, try_forgeries


def forgeries(tries: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> bool:
    """Try, print and, where asked, write the counts; False when a forgery was authenticated, or no honest film."""
    asked = forgery_cells(tries, seed)
    with CellStore(cells) as store:
        results = run_sweep(try_forgeries, asked, store, console, workers)
    rows = []
    for name in (HONEST, *ATTACKS):
        own = [result for cell, result in zip(asked, results, strict=True) if cell.parameters["attack"] == name]
        rows.append((name, {count: sum(int(result[count]) for result in own) for count in COUNTS}))
    for name, counts in rows:
        print(f"{name}: {', '.join(f'{counts[count]} {count}' for count in COUNTS)}")
    if out is not None:
        command = f"mtm-hil forgeries -n {tries} --seed {seed} --out {out}"
        write_result_csv(
            out, command, ("attack", *COUNTS), ((name, *(counts[count] for count in COUNTS)) for name, counts in rows)
        )
        print(f"wrote {out}")
    forged = sum(counts["authenticated"] for name, counts in rows if name != HONEST)
    return forged == 0 and rows[0][1]["authenticated"] > 0
