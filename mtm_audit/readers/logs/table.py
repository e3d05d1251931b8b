"""Tables of numbers in text: separators, decimal commas, and which line is wrong."""

import csv
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_audit.model.track import FARTHEST, Floats
from mtm_audit.readers.logs.body import Warn
from mtm_onboard.protocol.errors import MtmError

Line = tuple[int, str]

_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
# Seconds since the Unix epoch between the years 2001 and 2096, and the same instants in smaller units.
_UNIX_RANGES = {"s": (1e9, 4e9), "ms": (1e12, 4e12), "us": (1e15, 4e15), "ns": (1e18, 4e18)}
_NAMES_OF_TIME = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
# Sparser observations than this show no motion, so the unit is wrong.
_LONGEST_INTERVAL_S = 5.0
# No robot that is watched goes so far.
_WIDEST_M = 20_000.0


@dataclass(frozen=True)
class Table:
    """Numbers `values` (n, columns) and the line of the file, from 1, that each row stands in."""

    values: Floats
    lines: tuple[int, ...]


def content_of(lines: Sequence[str]) -> list[Line]:
    """Line numbers, counted from 1, and texts of the lines that are neither blank nor comments."""
    return [
        (number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    ]


def separator_of(line: str) -> str | None:
    """What separates the cells of a line: semicolons, tabs, commas, or else any white space (None)."""
    return next((separator for separator in (";", "\t", ",") if separator in line.strip()), None)


def cells_of(line: str, separator: str | None) -> list[str]:
    """The cells of a line without the space around them; raises ValueError when its quotes are broken."""
    if separator is None:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error as error:
        raise ValueError(str(error)) from error


def read_table(
    path: Path,
    content: Iterable[Line],
    separator: str | None,
    columns: int,
    form: str,
    wanted: Collection[int] | None = None,
) -> Table:
    """The lines as numbers; an empty cell is NaN, and what is beyond the columns is left out when it is empty.

    `form` is what a line should look like. Columns that are not among the `wanted` may hold words and become NaN.
    Raises MtmError that names the line when one does not hold as many numbers, and when there is no line.
    """
    rows, lines = [], []
    for number, line in content:
        try:
            cells = cells_of(line, separator)
            while len(cells) > columns and not cells[-1]:
                cells.pop()
            # Spreadsheets and some programs leave out what is empty at the end.
            if len(cells) != columns:
                raise ValueError
            numbers = (
                _number(cell, separator) if wanted is None or index in wanted else np.nan
                for index, cell in enumerate(cells)
            )
            rows.append(list(numbers))
        except ValueError as error:
            if not rows and not any(_is_number(cell, separator) for cell in cells_of(line, separator)):
                raise MtmError(
                    f"{path} is no log or motion capture of a format that is read (docs/formats.md): line {number} is "
                    f"not {columns} numbers, {form}; name another file"
                ) from error
            raise MtmError(
                f"{path}, line {number}: expected {columns} numbers, {form}; mend or remove the line"
            ) from error
        lines.append(number)
    if not rows:
        raise MtmError(f"{path} holds no samples; export the recording again")
    return Table(np.array(rows, dtype=float).reshape(len(rows), columns), tuple(lines))


def _number(cell: str, separator: str | None) -> float:
    if not cell:
        return np.nan
    if separator != "," and _DECIMAL_COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    return float(cell)


def _is_number(cell: str, separator: str | None) -> bool:
    try:
        return not np.isnan(_number(cell, separator))
    except ValueError:
        return False


def check_rows(path: Path, lines: Sequence[int], times_s: Floats, positions_m: Floats) -> None:
    """Raise MtmError that names the line where a time is no number or comes before the last, or a body is nowhere."""
    bad = np.flatnonzero(~np.isfinite(times_s))
    if len(bad):
        raise MtmError(f"{path}, line {lines[bad[0]]}: the time is not a number; mend or remove the line")
    late = np.flatnonzero(np.diff(times_s) < 0)
    if len(late):
        row = int(late[0]) + 1
        raise MtmError(
            f"{path}, line {lines[row]}: time {times_s[row]:.6f} s does not come after {times_s[row - 1]:.6f} s; "
            "sort the lines by time"
        )
    with np.errstate(invalid="ignore"):
        far = np.flatnonzero(np.any(np.abs(positions_m) > FARTHEST, axis=1))
    if len(far):
        raise MtmError(f"{path}, line {lines[far[0]]}: a position beyond {FARTHEST:g} m; mend or remove the line")


def unit_of_times(path: Path, times: Floats, warn: Warn) -> str | None:
    """The unit of times that count from the Unix epoch, which their size tells; None for any others.

    `warn` is told unless they are seconds.
    """
    first = float(times[0]) if len(times) else 0.0
    unit = next((name for name, (low, high) in _UNIX_RANGES.items() if low <= first < high), None)
    if unit in _NAMES_OF_TIME:
        warn(f"{path}: times are taken as {_NAMES_OF_TIME[unit]} since 1970, which their size tells")
    return unit


def question_units(path: Path, times_s: Floats, positions_m: Floats, warn: Warn) -> None:
    """Tell `warn` when times or positions are of a size that only a wrong unit explains."""
    if len(times_s) > 2 and float(np.median(np.diff(times_s))) >= _LONGEST_INTERVAL_S:
        warn(
            f"{path}: observations are {float(np.median(np.diff(times_s))):g} s apart; if its times are not seconds, "
            "say so with --time-unit"
        )
    seen = positions_m[np.all(np.isfinite(positions_m), axis=1)]
    if len(seen) and float(np.max(np.ptp(seen, axis=0))) > _WIDEST_M:
        warn(f"{path}: the motion is {float(np.max(np.ptp(seen, axis=0))):g} m wide; say with --unit what it is in")
