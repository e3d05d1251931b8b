"""`mtm-hil endurance`: the resources that a long run consumes, and whether its message can still be decoded."""

from dataclasses import astuple, fields
from pathlib import Path

from rich.console import Console

from hil.experiments.hardening.endurance import SYMBOLS, Checkpoint, endure
from hil.experiments.runs.result_file import write_result_csv


def endurance(hours: float, checkpoints: int, seed: int, out: Path | None, console: Console) -> None:
    """Run, print each checkpoint and, where asked, write them."""
    found = endure(3600.0 * hours, checkpoints, seed, lambda now_s: console.log(f"{now_s / 3600.0:.2f} h"))
    for one in found:
        print(
            f"{one.elapsed_s / 3600.0:.2f} h: {one.ticks} ticks, {one.missed} missed, {one.clamped} clamped, "
            f"{one.disturbed} disturbed, {one.faults} faults, {one.resident_bytes / 1e6:.1f} MB resident, journal "
            f"{one.journal_bytes / 1e6:.1f} MB with {one.journal_lost} rows lost, {one.symbols_right} of "
            f"{len(SYMBOLS)} symbols right, p = {one.p_value:.1e}"
        )
    if out is not None:
        command = f"mtm-hil endurance --hours {hours:g} --checkpoints {checkpoints} --seed {seed} --out {out}"
        write_result_csv(out, command, [field.name for field in fields(Checkpoint)], map(_row, found))
        print(f"wrote {out}")


def _row(one: Checkpoint) -> list[str]:
    return [f"{value:.6g}" if isinstance(value, float) and value < 1e3 else f"{value:.0f}" for value in astuple(one)]
