"""Tables with a header: which column is the time, which the position, which the heading, and in which unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.options import METRES, SECONDS, ReadOptions
from mtm_audit.readers.logs.table import (
    Line,
    cells_of,
    check_rows,
    question_units,
    read_table,
    separator_of,
    unit_of_times,
)
from mtm_onboard.protocol.errors import MtmError

# Times from here on, the year 2001, count from the Unix epoch.
EARLIEST_UNIX_S = 1e9

_UNITS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "millis": "ms", "msec": "ms", "millisecond": "ms",
    "milliseconds": "ms", "usec": "us", "µs": "us", "microseconds": "us", "nsec": "ns", "nanosec": "ns",
    "nanoseconds": "ns", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm",
    "millimeters": "mm", "millimetres": "mm", "centimeters": "cm", "centimetres": "cm", "inches": "in", "feet": "ft",
    "degree": "deg", "degrees": "deg", "°": "deg", "radian": "rad", "radians": "rad",
    **{unit: unit for unit in (*METRES, *SECONDS, "deg", "rad")},
}  # fmt: skip
_TIMES = ("time", "t", "timestamp", "timestamps", "stamp", "secs", "seconds", "elapsed", "elapsed_time", "header_stamp")
_POSITIONS = (
    "{}", "p{}", "t{}", "p_{}", "t_{}", "pos{}", "pos_{}", "{}_pos", "position_{}", "position{}", "{}_position",
    "translation_{}", "pose_{}", "p_rs_r_{}",
)  # fmt: skip
_POSITION_ENDS = ("_position_{}", "_translation_{}")
_QUATERNIONS = ("q{}", "q_{}", "quat_{}", "quaternion_{}", "orientation_{}", "rotation_{}", "rot_{}", "q_rs_{}")
_QUATERNION_ENDS = ("_orientation_{}", "_rotation_{}")
_YAWS = ("yaw", "heading", "theta", "psi", "orientation", "rotation")


@dataclass(frozen=True)
class Column:
    """One column of a header: where, its `name` in small letters with underscores, and its unit if it is named."""

    index: int
    name: str
    unit: str | None


@dataclass(frozen=True)
class Columns:
    """Those that make a pose; `height` is None in a plane, `turn` one column of yaw, four of x, y, z, w, or none."""

    time: Column
    position: tuple[Column, Column]
    height: Column | None = None
    turn: tuple[Column, ...] = ()

    @property
    def indices(self) -> frozenset[int]:
        """Where the columns are."""
        height = () if self.height is None else (self.height,)
        return frozenset(column.index for column in (self.time, *self.position, *height, *self.turn))


def header_columns(line: str) -> tuple[Column, ...]:
    """The columns that a header line names."""
    bare = line.lstrip().lstrip("#%").strip()
    return tuple(_column(index, cell) for index, cell in enumerate(cells_of(bare, separator_of(bare))))


def pose_columns(columns: Sequence[Column]) -> Columns | None:
    """Which columns make a pose; None when time, x or y is not among them."""
    by_name: dict[str, Column] = {}
    for column in columns:
        by_name.setdefault(column.name, column)
    time = _first(by_name, _TIMES, ())
    x, y, z = (
        _first(by_name, [form.format(a) for form in _POSITIONS], [e.format(a) for e in _POSITION_ENDS]) for a in "xyz"
    )
    if time is None or x is None or y is None:
        return None
    parts = [
        _first(by_name, [form.format(a) for form in _QUATERNIONS], [e.format(a) for e in _QUATERNION_ENDS])
        for a in "xyzw"
    ]
    yaw = _first(by_name, _YAWS, ())
    turn = tuple(part for part in parts if part is not None)
    return Columns(time, (x, y), z, turn if len(turn) == 4 else (yaw,) if yaw is not None else ())


def read_columns(
    path: Path, header: Line, content: Sequence[Line], columns: Columns, options: ReadOptions, warn: Warn
) -> Log:
    """The body of a table below its header; raises MtmError that names the line that is wrong."""
    bare = header[1].lstrip().lstrip("#%").strip()
    separator = separator_of(bare)
    names = [cell.strip() for cell in cells_of(bare, separator)]
    table = read_table(path, content, separator, len(names), f"'{','.join(names)[:120]}'", columns.indices)
    times = table.values[:, columns.time.index]
    # A header's own word comes first, then what the size of the times leaves no doubt about.
    stated = columns.time.unit if columns.time.unit in SECONDS else None
    if stated is None and options.time_unit is None:
        stated = unit_of_times(path, times, warn)
    times_s = times * options.seconds(stated)
    x, y = columns.position
    unit_m = options.metres(x.unit if x.unit in METRES else None)
    height = np.zeros(len(times)) if columns.height is None else table.values[:, columns.height.index]
    positions_m = np.stack([table.values[:, x.index], table.values[:, y.index], height], axis=1) * unit_m
    check_rows(path, table.lines, times_s, positions_m[:, :2])
    question_units(path, times_s, positions_m, warn)
    body = _body(path.stem, times_s, positions_m, table.values, columns, options.up or "z")
    return Log((body,), at=at_of_unix_times(times_s))


def at_of_unix_times(times_s: Floats) -> RecordedAt | None:
    """When the clock stood at zero: known of times that count from the Unix epoch alone."""
    return RecordedAt(0.0) if len(times_s) and float(times_s[0]) > EARLIEST_UNIX_S else None


def _body(name: str, times_s: Floats, positions_m: Floats, values: Floats, columns: Columns, up: str) -> Body:
    turn = values[:, [column.index for column in columns.turn]]
    if len(columns.turn) == 4:
        return Body(name, times_s, positions_m, quaternions_xyzw=turn, up=up)
    if len(columns.turn) == 1:
        scale = np.deg2rad(1.0) if columns.turn[0].unit == "deg" else 1.0
        return Body(name, times_s, positions_m, headings_rad=turn[:, 0] * scale, up=up)
    return Body(name, times_s, positions_m, up=up)


def _column(index: int, cell: str) -> Column:
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]", cell.strip())
    name, unit = (found[1], found[2].strip().lower()) if found else (cell, "")
    name = re.sub(r"[\s./:-]+", "_", name.strip().lower()).strip("_")
    stem, _, last = name.rpartition("_")
    if not unit and stem and last in _UNITS:
        name, unit = stem, last
    return Column(index, name, _UNITS.get(unit))


def _first(by_name: dict[str, Column], names: Sequence[str], ends: Sequence[str]) -> Column | None:
    exact = next((by_name[name] for name in names if name in by_name), None)
    return exact or next((by_name[name] for name in by_name if name.endswith(tuple(ends))), None) if ends else exact


def lacking(path: Path, columns: Sequence[Column]) -> MtmError:
    """The refusal of a table whose header has no time or no position."""
    names = {column.name for column in columns}
    wanted = {
        "time": _TIMES,
        "x": [form.format("x") for form in _POSITIONS],
        "y": [form.format("y") for form in _POSITIONS],
    }
    missing = next((name for name, known in wanted.items() if not names & set(known)), "x")
    return MtmError(
        f"{path}: the header lacks the column {missing!r}; begin the table with 'time,x,y' or 'time,x,y,z,yaw'"
    )
