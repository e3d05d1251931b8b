"""`mtm-hil cameras`: evidence for a message filmed by a hand that shakes, pans and rolls, and by markers' angle."""

from pathlib import Path

from rich.console import Console

from hil.experiments.cameras import tilted
from hil.experiments.cameras.filmed import Row, camera_cells, film_and_decode, rows_of
from hil.experiments.cameras.tilted import film_and_read, tilted_cells
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = (
    "what", "floor", "shake_px", "pan_deg", "roll_deg", "angle_deg", "rollouts", "right", "seen", "bits", "share",
)  # fmt: skip


def cameras(rollouts: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write the evidence that each camera leaves."""
    plans = camera_cells(rollouts, seed)
    with CellStore(cells) as store:
        run_sweep(film_and_decode, [cell for plan in plans for cell in plan], store, console, workers)
        rows = rows_of([run_sweep(film_and_decode, plan, store, console, 1) for plan in plans])
    for row in rows:
        print(_sentence(row))
    if out is not None:
        write_result_csv(
            out, f"mtm-hil cameras -n {rollouts} --seed {seed} --out {out}", _COLUMNS, map(_cells_of, rows)
        )
        print(f"wrote {out}")


def tilts(rollouts: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write what a calibration and the view from above are worth."""
    plans = tilted_cells(rollouts, seed)
    with CellStore(cells) as store:
        run_sweep(film_and_read, [cell for plan in plans for cell in plan], store, console, workers)
        rows = tilted.rows_of([run_sweep(film_and_read, plan, store, console, 1) for plan in plans])
    for row in rows:
        said = ", ".join(f"{way} {row.nats[way]:.0f}" for way in tilted.WAYS)
        print(f"{row.view.lens} lens, {row.view.tilt_deg:g} degrees from straight down: {said} nats")
    if out is not None:
        table = (
            (row.view.lens, row.view.tilt_deg, row.rollouts, *(f"{row.nats[way]:.1f}" for way in tilted.WAYS))
            for row in rows
        )
        command = f"mtm-hil cameras --tilts -n {rollouts} --seed {seed} --out {out}"
        write_result_csv(out, command, ("lens", "tilt_deg", "rollouts", *tilted.WAYS), table)
        print(f"wrote {out}")


def _sentence(row: Row) -> str:
    case = row.condition
    how = f"{case.what}, floor {case.floor}, {case.shake_px:g} px, pan {case.pan_deg:g}, roll {case.roll_deg:g} degrees"
    what = f"markers at {case.angle_deg:g} degrees" if case.what == "angle" else how
    return f"{what}: {row.bits:.0f} bits, {100 * row.share:.0f} %, {row.right} of {row.rollouts} messages right"


def _cells_of(row: Row) -> tuple[object, ...]:
    case = row.condition
    return (
        case.what, case.floor, case.shake_px, case.pan_deg, case.roll_deg, case.angle_deg, row.rollouts, row.right,
        f"{row.seen:.4f}", f"{row.bits:.1f}", f"{row.share:.3f}",
    )  # fmt: skip
