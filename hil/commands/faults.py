"""`mtm-hil faults`: a robot under faults of its wire."""

from dataclasses import astuple, fields
from pathlib import Path

from rich.console import Console

from hil.experiments.hardening.faults import Outcome, Row, fault_cell, fault_cells, row_of
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_NO_LOSS = "no"
_COLUMNS = (
    "wire", "fault", "loss", "seed", "stops", "is_fresh", "is_read", "silent_deadline_s", "lost_deadline_s",
    *(field.name for field in fields(Outcome)),
)  # fmt: skip


def faults(seeds: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> bool:
    """Measure, print and, where asked, write the matrix; False when a run fails a requirement."""
    asked = fault_cells(seeds, seed)
    with CellStore(cells) as store:
        results = run_sweep(fault_cell, asked, store, console, workers)
    lines = [row_of(cell, result) for cell, result in zip(asked, results, strict=True)]
    for line in lines:
        print(_sentence(line))
    wrong = sum(not (line.stops and line.is_fresh and line.is_read) for line in lines)
    print(f"{len(lines)} runs, {wrong} of them failed")
    if out is not None:
        command = f"mtm-hil faults -n {seeds} --seed {seed} --out {out}"
        write_result_csv(out, command, _COLUMNS, map(_row, lines))
        print(f"wrote {out}")
    return wrong == 0


def _sentence(line: Row) -> str:
    one = line.outcome
    return (
        f"{line.wire}, {line.fault}, link {line.loss or 'kept'}: stopped {one.silent_stop_s:.2f} s after the last base "
        f"command ({line.silent_deadline_s:.2f} allowed){_loss(line)}; commands at most {one.arrived_s:.2f} s old "
        f"on arrival and {one.held_s:.2f} s in force, {one.altered} altered; {one.sent} of {one.windows} windows sent, "
        f"message {'decoded' if one.is_decoded else 'not decoded'}"
        f"{'' if line.stops and line.is_fresh and line.is_read else ' - FAILED'}"
    )


def _loss(line: Row) -> str:
    if not line.loss:
        return ""
    if line.lost_deadline_s is None:
        return ", no deadman at the far end"
    return f", {line.outcome.lost_stop_s:.2f} s after the loss ({line.lost_deadline_s:.2f} allowed)"


def _row(line: Row) -> tuple[object, ...]:
    deadline = "none" if line.lost_deadline_s is None else f"{line.lost_deadline_s:g}"
    numbers = [f"{value:.6g}" if isinstance(value, float) else value for value in astuple(line.outcome)]
    return (
        line.wire, line.fault, line.loss or _NO_LOSS, line.seed, line.stops, line.is_fresh, line.is_read,
        f"{line.silent_deadline_s:g}", deadline, *numbers,
    )  # fmt: skip
