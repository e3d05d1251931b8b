"""`mtm-hil capacity`: what one robot could send by Shannon's bound, by plant, axes and loudness."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.experiments.plants.capacity import BANDS_HZ, WIDE_HZ, Capacity, capacities
from hil.experiments.runs.result_file import write_result_csv

_COLUMNS = (
    "plant", "against", "axes", "sigma_mps", "sigma_radps", "robots", "flat_bps", "least_bps", "most_bps",
    "filled_bps", "wide_filled_bps",
)  # fmt: skip


def capacity(out: Path | None, console: Console) -> None:
    """Compute, print and, where asked, write the table."""
    rows = capacities()
    console.print(_table(rows))
    if out is not None:
        notes = tuple(
            f"{plant}: flat and filled in {low:g}-{high:g} Hz, wide in {WIDE_HZ[plant][0]:g}-{WIDE_HZ[plant][1]:g} Hz"
            for plant, (low, high) in BANDS_HZ.items()
        )
        write_result_csv(out, f"mtm-hil capacity --out {out}", _COLUMNS, map(_line, rows), notes)
        print(f"wrote {out}")


def _line(row: Capacity) -> tuple[object, ...]:
    figures = (row.flat_bps, row.least_bps, row.most_bps, row.filled_bps, row.wide_bps)
    return (row.plant, row.against, " ".join(row.axes), *row.sigmas, row.robots, *(f"{own:.2f}" for own in figures))


def _table(rows: Sequence[Capacity]) -> Table:
    table = Table(title="bits/s of one robot by Shannon's bound", box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for name in ("plant", "against", "axes", "m/s, rad/s", "flat", "of each", "filled", "wide"):
        table.add_column(name, no_wrap=True)
    for row in rows:
        speed, turn = row.sigmas
        span = "" if row.robots == 1 else f"{row.least_bps:.1f}-{row.most_bps:.1f}"
        table.add_row(
            row.plant, row.against, " ".join(row.axes), f"{speed:g}, {turn:g}", f"{row.flat_bps:.2f}", span,
            f"{row.filled_bps:.2f}", f"{row.wide_bps:.2f}",
        )  # fmt: skip
    return table
