"""`mtm-hil quiet`: how quiet a message may be on a robot that was identified."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.experiments.plants.quiet import JOBS, TURN_RADPM, QuietRow, quiet_rows
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv

_COLUMNS = (
    "alphabet_size", "window_ticks", "symbols", "bits", "seconds", "sigma_mps", "sigma_radps", "messages", "received",
    "received_low", "received_high", "wrong", "symbols_right", "symbols_low", "symbols_high", "median_bits",
)  # fmt: skip


def quiet(messages: int, seed: int, console: Console, *, workers: int | None, out: Path | None, cells: Path) -> None:
    """Measure, print and, where asked, write the table."""
    with CellStore(cells) as store:
        rows = quiet_rows(JOBS, messages, store, console, seed=seed, workers=workers)
    console.print(_table(rows))
    if out is not None:
        notes = ("one Create, forward speed and turn rate say the same, onset known, clock searched; percent",)
        write_result_csv(
            out, f"mtm-hil quiet -n {messages} --seed {seed} --out {out}", _COLUMNS, map(_line, rows), notes
        )
        print(f"wrote {out}")


def _line(row: QuietRow) -> tuple[object, ...]:
    job = row.job
    return (
        job.alphabet_size, job.window_ticks, job.symbols, f"{job.bits:g}", f"{job.seconds:g}", f"{job.sigma_mps:g}",
        f"{TURN_RADPM * job.sigma_mps:g}", row.received.trials, *row.received.figures, row.wrong,
        *row.symbols.figures, f"{row.median_bits:.1f}",
    )  # fmt: skip


def _table(rows: Sequence[QuietRow]) -> Table:
    table = Table(title="Plain messages of one Create; percent with exact 95 % intervals", box=None)
    for name in ("bits", "s", "m/s, rad/s", "received", "wrong", "symbols", "evidence, bits"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        job = row.job
        table.add_row(
            f"{job.bits:g}", f"{job.seconds:g}", f"{job.sigma_mps:g}, {TURN_RADPM * job.sigma_mps:g}",
            str(row.received), str(row.wrong), str(row.symbols), f"{row.median_bits:.1f}",
        )  # fmt: skip
    return table
