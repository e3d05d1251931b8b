"""Motion-capture files: TUM trajectories and CSV tables, one body per file, named after the file.

A TUM trajectory has eight numbers a line, `timestamp tx ty tz qx qy qz qw` (the format of the TUM RGB-D benchmark
and of the evo tool), and comment lines that start with `#`. A CSV table has a header naming its columns: `time`,
`x` and `y`, optionally `z` and `yaw` (radians); further columns are ignored. Times are seconds, positions metres.
"""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mtm_audit.model.track import FARTHEST, Floats, Track
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

TUM_COLUMNS = 8
CSV_NEEDS = ("time", "x", "y")


def read_tum(path: Path) -> Track:
    """Read a TUM trajectory: axes x and y in metres, headings from the quaternions.

    A line with a NaN is a sample that was not observed. Raises MtmError that names the line when one does not hold
    eight numbers or a time does not come after the one before it.
    """
    rows = [(number, line.split()) for number, line in _content(read_lines(path))]
    table = _table(path, rows, TUM_COLUMNS, "'timestamp tx ty tz qx qy qz qw'")
    qx, qy, qz, qw = table[:, 4:].T
    # A quaternion that overflows has no heading and becomes NaN.
    with np.errstate(over="ignore", invalid="ignore"):
        yaws = np.arctan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return _track(path, [number for number, _ in rows], table[:, 0], table[:, 1:3], yaws)


def read_csv(path: Path) -> Track:
    """Read a CSV table with a header: axes x and y in metres, headings when there is a `yaw` column.

    Empty cells and NaN are samples that were not observed. Raises MtmError as `read_tum` does, and when the header
    lacks a column.
    """
    content = _content(read_lines(path))
    _, header_line = next(content, (0, ""))
    header = [name.strip().lower() for name in header_line.split(",")]
    missing = [name for name in CSV_NEEDS if name not in header]
    if missing:
        raise MtmError(
            f"{path}: the header lacks the column {missing[0]!r}; begin the table with 'time,x,y' or 'time,x,y,z,yaw'"
        )
    rows = [(number, [cell.strip() or "nan" for cell in _cells(path, number, line)]) for number, line in content]
    table = _table(path, rows, len(header), f"'{','.join(header)}'")
    yaws = table[:, header.index("yaw")] if "yaw" in header else None
    positions = table[:, [header.index("x"), header.index("y")]]
    return _track(path, [number for number, _ in rows], table[:, header.index("time")], positions, yaws)


def read_motion_capture(path: Path) -> Track:
    """Read a CSV table when the suffix is `.csv` or the first line that is no comment holds a comma; else TUM."""
    _, first = next(_content(read_lines(path)), (0, ""))
    return read_csv(path) if path.suffix.lower() == ".csv" or "," in first else read_tum(path)


def _content(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Line numbers, counted from 1, and texts of the lines that are neither blank nor comments."""
    return (
        (number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    )


def _cells(path: Path, number: int, line: str) -> list[str]:
    try:
        return next(csv.reader([line]), [])
    except csv.Error as error:
        raise MtmError(f"{path}, line {number}: not a line of a CSV table ({error}); mend or remove it") from error


def _table(path: Path, rows: list[tuple[int, list[str]]], columns: int, form: str) -> Floats:
    """The rows as numbers, shape (n, columns)."""
    table = np.empty((len(rows), columns))
    for index, (number, cells) in enumerate(rows):
        try:
            if len(cells) != columns:
                raise ValueError
            table[index] = [float(cell) for cell in cells]
        except ValueError as error:
            raise MtmError(
                f"{path}, line {number}: expected {columns} numbers, {form}; mend or remove the line"
            ) from error
    return table


def _track(path: Path, numbers: list[int], times_s: Floats, positions: Floats, yaws: Floats | None) -> Track:
    if not numbers:
        raise MtmError(f"{path} holds no samples; export the recording again")
    bad = np.flatnonzero(~np.isfinite(times_s))
    if len(bad):
        raise MtmError(f"{path}, line {numbers[bad[0]]}: the time is not a number; mend or remove the line")
    late = np.flatnonzero(np.diff(times_s) <= 0)
    if len(late):
        row = int(late[0]) + 1
        raise MtmError(
            f"{path}, line {numbers[row]}: time {times_s[row]:.6f} s does not come after {times_s[row - 1]:.6f} s; "
            "sort the lines by time and remove repeated ones"
        )
    valid = np.asarray(np.all(np.isfinite(positions), axis=1), dtype=np.bool_)
    positions = np.where(valid[:, None], positions, np.nan)
    far = np.flatnonzero(np.any(np.abs(positions) > FARTHEST, axis=1))
    if len(far):
        raise MtmError(f"{path}, line {numbers[far[0]]}: a position beyond {FARTHEST:g} m; mend or remove the line")
    headings = None if yaws is None else np.where(np.isfinite(yaws), yaws, np.nan)
    return Track(path.stem, times_s, positions, valid, headings_rad=headings)
