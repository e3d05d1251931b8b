"""`mtm-hil paper`: the paper's tables, measured here."""

from pathlib import Path

from rich.console import Console

from hil.experiments.cells import CellStore
from hil.experiments.paper_robomaster import measure, rich_table, write_csv
from hil.robots.mecanum import calibrated_parameters


def paper_robomaster(rollouts: int, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write the RoboMaster table."""
    plant = calibrated_parameters()
    with CellStore(cells) as store:
        rows = measure(plant, rollouts, store, console)
    console.print(rich_table(rows))
    if out is not None:
        command = f"mtm-hil paper robomaster -n {rollouts} --out {out}"
        write_csv(out, rows, (command, f"{plant}"))
        print(f"wrote {out}")
