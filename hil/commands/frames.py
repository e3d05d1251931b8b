"""`mtm-hil frames`: framed messages under noise and attack, on simulated log-likelihood ratios."""

from pathlib import Path

from rich.console import Console

from hil.experiments.messages.frames import Row, frame_cells, read_frames, row_of
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = (
    "what", "code", "check", "check_bits", "distance", "frames", "right", "wrong", "wrong_low", "wrong_high", "tries",
    "expected_wrong",
)  # fmt: skip


def frames(count: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write how often frames are read right and wrong."""
    plans = frame_cells(count, seed)
    with CellStore(cells) as store:
        run_sweep(read_frames, [cell for plan in plans for cell in plan], store, console, workers)
        lines = [row_of(plan, run_sweep(read_frames, plan, store, console, 1)) for plan in plans]
    for line in lines:
        print(_sentence(line))
    if out is not None:
        command = f"mtm-hil frames -n {count} --seed {seed} --out {out}"
        write_result_csv(out, command, _COLUMNS, map(_row, lines))
        print(f"wrote {out}")


def _sentence(line: Row) -> str:
    at = f", distance {line.distance:g}" if line.distance else ""
    return (
        f"{line.what}, {line.check} of {line.check_bits} bits, code {line.code}{at}: of {line.frames} frames "
        f"{line.right} read right and {line.wrong} wrong, {line.expected_wrong:.2g} expected of {line.tries} tries"
    )


def _row(line: Row) -> tuple[object, ...]:
    low, high = clopper_pearson(line.wrong, line.frames)
    return (
        line.what, line.code, line.check, line.check_bits, line.distance, line.frames, line.right, line.wrong,
        f"{low:.6f}", f"{high:.6f}", line.tries, f"{line.expected_wrong:.4g}",
    )  # fmt: skip
