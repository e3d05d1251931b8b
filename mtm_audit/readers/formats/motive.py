"""OptiTrack Motive's CSV export, of format 1.1 on: rigid bodies, or else markers, in several rows of header."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import quaternions_of_euler
from mtm_audit.readers.logs.rigid import grouped, rigid_body
from mtm_audit.readers.logs.table import cells_of, check_rows, read_table, separator_of
from mtm_audit.readers.logs.wall_clock import captured_at
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in", "feet": "ft"}
_BODY_KINDS = ("rigid body", "bone")


@dataclass(frozen=True)
class _Header:
    facts: dict[str, str]
    kinds: list[str]
    names: list[str]
    parts: list[str]
    axes: list[str]
    first_line: int
    separator: str


def recognises_motive(opening: Opening) -> bool:
    """Whether it begins with the version of Motive's format."""
    return bool(opening.lines) and opening.lines[0].lstrip('"').startswith("Format Version")


def read_motive(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """All rigid bodies, or bodies of named markers when there are none; an empty cell is unseen.

    Lengths are of the header's unit and times frames over the export's rate. Motive's y axis points up unless another
    convention was chosen for the export, which the file does not say. Raises MtmError when nothing was exported.
    """
    lines = read_lines(path)
    header = _header(path, lines)
    content = [line for line in enumerate(lines, 1) if line[0] > header.first_line and line[1].strip()]
    table = read_table(path, content, header.separator, len(header.axes), "the cells of the header")
    unit_m = options.metres(_UNITS.get(header.facts.get("length units", "").lower()))
    times_s = _times_s(header, table.values) * (options.seconds() if options.time_unit else 1.0)
    up = options.up or "y"
    bodies = tuple(_rigid_bodies(header, times_s, table.values, unit_m, up))
    if not bodies or options.bodies:
        bodies = tuple(_marker_bodies(path, header, times_s, table.values * unit_m, up, options, warn))
    if not bodies:
        version = header.facts.get("format version", "of unknown version")
        raise MtmError(
            f"{path} is an export of Motive (format {version}) without a rigid body or marker in it; define the robot "
            "as a rigid body and export again"
        )
    for body in bodies:
        check_rows(path, table.lines, times_s, body.positions_m)
    return Log(bodies, at=captured_at(header.facts.get("capture start time", ""), str(path), warn))


def _header(path: Path, lines: list[str]) -> _Header:
    separator = separator_of(lines[0]) or ","
    facts = _split(path, lines[0], 1, separator)
    rows: list[list[str]] = []
    for number, line in enumerate(lines[1:60], 2):
        cells = _split(path, line, number, separator)
        if cells and cells[0].lower() == "frame":
            width = len(cells)
            kinds, names, parts = (_row(rows, place, width) for place in _places(rows))
            return _Header(
                dict(zip((fact.lower() for fact in facts[::2]), facts[1::2], strict=False)),
                [kind.lower() for kind in kinds], names, [part.lower() for part in parts],
                [cell.lower() for cell in cells], number, separator,
            )  # fmt: skip
        if any(cells[1:]):
            rows.append(cells)
    raise MtmError(f"{path} is an export of Motive without a row that begins with Frame; export it again")


def _places(rows: list[list[str]]) -> tuple[int, int, int]:
    """Which rows above the axes hold kinds, names and what is measured: newer exports add a row of parents."""
    return 0, 1, len(rows) - 1


def _row(rows: list[list[str]], place: int, width: int) -> list[str]:
    cells = rows[place] if 0 <= place < len(rows) else []
    return (cells + [""] * width)[:width]


def _split(path: Path, line: str, number: int, separator: str) -> list[str]:
    try:
        return cells_of(line, separator)
    except ValueError as error:
        raise MtmError(f"{path}, line {number}: broken quotes; export it again") from error


def _times_s(header: _Header, values: Floats) -> Floats:
    """Times from frames and rate, which are exact where the column is rounded to milliseconds."""
    frames, times_s = values[:, 0], values[:, 1] if values.shape[1] > 1 else np.full(len(values), np.nan)
    try:
        rate_hz = float(header.facts.get("export frame rate", "nan").replace(",", "."))
    except ValueError:
        rate_hz = np.nan
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        return times_s
    exact_s = times_s[0] + (frames - frames[0]) / rate_hz
    # Not where the export skips frames, or counts them by another rate.
    return exact_s if np.all(np.abs(exact_s - times_s - np.median(exact_s - times_s)) < 2e-3) else times_s


def _columns(header: _Header, name: str, part: str, kinds: tuple[str, ...]) -> dict[str, int]:
    return {
        header.axes[index]: index
        for index in range(2, len(header.axes))
        if header.names[index] == name and header.parts[index] == part and header.kinds[index] in kinds
        and header.axes[index]
    }  # fmt: skip


def _rigid_bodies(header: _Header, times_s: Floats, values: Floats, unit_m: float, up: str) -> list[Body]:
    found = []
    names = dict.fromkeys(n for n, kind in zip(header.names, header.kinds, strict=True) if kind in _BODY_KINDS)
    for name in names:
        place = _columns(header, name, "position", _BODY_KINDS)
        turn = _columns(header, name, "rotation", _BODY_KINDS)
        if not {"x", "y", "z"} <= place.keys():
            continue
        positions_m = values[:, [place[axis] for axis in "xyz"]] * unit_m
        if np.any(np.isfinite(positions_m)):
            found.append(Body(name, times_s, positions_m, quaternions_xyzw=_turns(header, turn, values), up=up))
    return found


def _turns(header: _Header, turn: dict[str, int], values: Floats) -> Floats | None:
    order = header.facts.get("rotation type", "Quaternion")
    if {"x", "y", "z", "w"} <= turn.keys():
        return np.asarray(values[:, [turn[axis] for axis in "xyzw"]])
    if {"x", "y", "z"} <= turn.keys() and sorted(order.upper()) == ["X", "Y", "Z"]:
        # Motive's Euler angles are in degrees about its own axes in the order named.
        angles = np.deg2rad(values[:, [turn[axis] for axis in order.lower()]])
        return quaternions_of_euler(angles, order.upper())
    return None


def _marker_bodies(
    path: Path, header: _Header, times_s: Floats, values_m: Floats, up: str, options: ReadOptions, warn: Warn
) -> list[Body]:
    kinds = tuple({kind for kind in header.kinds if "marker" in kind})
    labels = list(dict.fromkeys(n for n, kind in zip(header.names, header.kinds, strict=True) if kind in kinds and n))
    places = {label: _columns(header, label, "position", kinds) for label in labels}
    labels = [label for label in labels if {"x", "y", "z"} <= places[label].keys()]
    groups = grouped(labels, options.bodies, str(path))
    found = []
    for name, members in groups.items():
        markers_m = np.stack([values_m[:, [places[labels[m]][a] for a in "xyz"]] for m in members], axis=1)
        if np.any(np.isfinite(markers_m)):
            found.append(rigid_body(name, times_s, markers_m, up, str(path), warn))
    return found
