"""`mtm-hil codecs`: what encoders leave of a message in a film."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from hil.experiments.films.codecs import PIXELS_PER_METRE, SIGMAS_MPS, film_under_all, filmed, motion_px
from hil.experiments.films.coding import CODINGS
from hil.experiments.films.motion import MOTIONS_PX, kept_under_all
from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_EVIDENCE_COLUMNS = (
    "sigma_mps", "pixels_per_metre", "motion_px", "codec", "quality", "bits_per_pixel", "kbit_s", "rollouts",
    "decoded", "evidence_bits", "share_of_lossless", "motion_capture_bits",
)  # fmt: skip
_EVIDENCE_NOTES = (
    "motion_px: root mean square displacement along one axis that the noise commands; robots do less of it",
    "evidence_bits: mean over rollouts, 14 s with one message of 12 s of four robots whose start is known",
)
_MOTION_COLUMNS = ("motion_px", "codec", "quality", "bits_per_pixel", "films", "correlation", "gain")
_MOTION_NOTES = ("a marker of 60 px moving as noise of 0.5 to 5 Hz for 12 s; correlation and gain of what is tracked",)
Row = tuple[object, ...]


@dataclass(frozen=True)
class CodecOptions:
    """What the command line asked for; `count` rollouts or films of each kind."""

    count: int
    seed: int
    workers: int | None
    out: Path | None
    cells: Path


def evidence(options: CodecOptions, console: Console) -> None:
    """Measure, print and, where asked, write evidence under each coding, at each loudness and size of the picture."""
    rows: list[Row] = []
    with CellStore(options.cells) as store:
        for sigma_mps in SIGMAS_MPS:
            for pixels in PIXELS_PER_METRE:
                asked: Values = {"sigma_mps": sigma_mps, "pixels_per_metre": pixels}
                jobs = [Cell("codecs", asked, options.seed + row) for row in range(options.count)]
                rows += _evidence_rows(
                    sigma_mps, pixels, run_sweep(film_under_all, jobs, store, console, options.workers)
                )
    _write("evidence", options, _EVIDENCE_COLUMNS, rows, _EVIDENCE_NOTES)


def motion(options: CodecOptions, console: Console) -> None:
    """Measure, print and, where asked, write how much of a small motion each coding keeps."""
    rows: list[Row] = []
    with CellStore(options.cells) as store:
        for moved_px in MOTIONS_PX:
            jobs = [Cell("codecs motion", {"motion_px": moved_px}, options.seed + row) for row in range(options.count)]
            results = run_sweep(kept_under_all, jobs, store, console, options.workers)
            print(f"{moved_px:g} px of motion")
            for coding in CODINGS:
                kept, gain, density = (
                    _mean(results, f"{coding.name} {field}") for field in ("kept", "gain", "bits a pixel")
                )
                print(f"  {coding.name:26s} {density:7.4f} bits a pixel, correlation {kept:6.3f}, gain {gain:6.3f}")
                head = (moved_px, coding.codec, coding.quality, f"{density:.4f}", len(results))
                rows.append((*head, f"{kept:.3f}", f"{gain:.3f}"))
    _write("motion", options, _MOTION_COLUMNS, rows, _MOTION_NOTES)


def _evidence_rows(sigma_mps: float, pixels: int, results: list[Values]) -> list[Row]:
    """A row for each coding, printed as well."""
    moved_px, captured = motion_px(sigma_mps, pixels), _mean(results, "motion capture bits")
    print(f"sigma {sigma_mps:g} m/s, {pixels} px a metre: {moved_px:.2f} px of motion; {captured:.0f} bits by mocap")
    lossless = _mean(results, f"{CODINGS[0].name} bits")
    rows: list[Row] = []
    for coding in CODINGS:
        bits, density, kbit_s = (
            _mean(results, f"{coding.name} {field}") for field in ("bits", "bits a pixel", "kbit/s")
        )
        decoded = sum(filmed(result, coding).decoded for result in results)
        print(f"  {coding.name:26s} {density:7.4f} bits a pixel {bits:8.1f} bits, {decoded} of {len(results)} decoded")
        share = f"{max(bits, 0.0) / lossless:.3f}" if lossless > 0.0 else ""
        head = (sigma_mps, pixels, f"{moved_px:.3f}", coding.codec, coding.quality, f"{density:.4f}", f"{kbit_s:.0f}")
        rows.append((*head, len(results), decoded, f"{bits:.1f}", share, f"{captured:.1f}"))
    return rows


def _mean(results: list[Values], field: str) -> float:
    return float(np.mean([float(result[field]) for result in results]))


def _write(arm: str, options: CodecOptions, columns: tuple[str, ...], rows: list[Row], notes: tuple[str, ...]) -> None:
    if options.out is not None:
        command = f"mtm-hil codecs {arm} -n {options.count} --seed {options.seed} --out {options.out}"
        write_result_csv(options.out, command, columns, rows, notes)
        print(f"wrote {options.out}")
