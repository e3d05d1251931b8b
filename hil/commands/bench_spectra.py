"""`mtm-hil bench --spectra`: what the noise's spectrum is worth at 6 bits/s."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.experiments.detectors.spectra import DETECTORS, FIRST_SEED, filled_points, spectra_rows, told
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.plants.mecanum import calibrated_parameters

_COLUMNS = (
    "spectrum", "symbols", *(f"{name}{end}" for name in DETECTORS for end in ("", "_low", "_high")), "capacity_bps",
)  # fmt: skip


@dataclass(frozen=True)
class SpectraOptions:
    """How many rollouts, and where they are written."""

    rollouts: int
    out: Path | None
    cells: Path


def bench_spectra(options: SpectraOptions, console: Console) -> None:
    """Measure, print and, where asked, write the table."""
    with CellStore(options.cells) as store:
        rows = spectra_rows(options.rollouts, FIRST_SEED, store, console)
    print("\n".join(told(rows)))
    points = ",".join(f"{hz:g}:{level_db:g}" for hz, level_db in filled_points(calibrated_parameters()))
    print(f"water-filled: {points}")
    if options.out is None:
        return
    lines = []
    for row in rows:
        shares = [row.symbols[name] for name in DETECTORS]
        values = [figure for share in shares for figure in share.figures]
        lines.append((row.shape, shares[0].trials, *values, f"{row.capacity_bps:.2f}"))
    command = f"mtm-hil bench --spectra --rollouts {options.rollouts} --out {options.out}"
    notes = ("M = 4096, T = 100, four symbols of four robots, sigma 0.1 m/s, onset known", f"water-filled: {points}")
    write_result_csv(options.out, command, _COLUMNS, lines, notes)
    print(f"wrote {options.out}")
