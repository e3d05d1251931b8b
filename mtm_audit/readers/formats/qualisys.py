"""Qualisys Track Manager's TSV exports: rigid bodies (6D) or markers (3D), millimetres and degrees."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import quaternions_of_matrices
from mtm_audit.readers.logs.rigid import grouped, rigid_body
from mtm_audit.readers.logs.table import Table, check_rows, read_table
from mtm_audit.readers.logs.wall_clock import captured_at
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

_KEY = re.compile(r"[A-Z][A-Z0-9_]+")
# X, Y, Z, three angles, residual, nine elements of the matrix.
_BODY_COLUMNS, _MATRIX_FROM = 16, 7


@dataclass(frozen=True)
class _File:
    facts: dict[str, list[str]]
    timed: bool
    table: Table
    width: int


def recognises_qualisys(opening: Opening) -> bool:
    """Whether it begins with the number of frames as Qualisys writes it."""
    return bool(opening.lines) and opening.lines[0].startswith("NO_OF_FRAMES")


def read_qualisys(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """All bodies of a 6D export, or bodies of named markers of a 3D export; the z axis points up.

    A pose of zeros, or an empty one, is unseen. Times are those of the Time column, or frames over the frequency.
    Raises MtmError when the header lacks what is needed or nothing is in it.
    """
    file = _file(path, options)
    times_s = _times_s(path, file)
    unit_m = options.metres("mm")
    if file.width == _BODY_COLUMNS:
        bodies = _bodies(file, times_s, unit_m, options)
    else:
        bodies = _marked(path, file, times_s, unit_m, options, warn)
    if not bodies:
        raise MtmError(f"{path} is an export of Qualisys without a body or marker that was seen; export it again")
    for body in bodies:
        check_rows(path, file.table.lines, times_s, body.positions_m)
    stamp = " ".join(file.facts.get("TIME_STAMP", [""])[:1])
    return Log(tuple(bodies), at=captured_at(stamp, str(path), warn))


def _file(path: Path, options: ReadOptions) -> _File:
    facts: dict[str, list[str]] = {}
    lines = list(enumerate(read_lines(path), 1))
    row = 0
    while row < len(lines) and _KEY.fullmatch(lines[row][1].split("\t")[0].strip()):
        key, *values = lines[row][1].rstrip("\t").split("\t")
        facts[key.strip()] = [value.strip() for value in values]
        row += 1
    named = row < len(lines) and not _is_number(lines[row][1].split("\t")[0])
    header = [cell.strip() for cell in lines[row][1].split("\t")] if named else []
    content = [line for line in lines[row + named :] if line[1].strip()]
    timed = header[:2] == ["Frame", "Time"]
    names = _names(facts, path)
    lead = 2 if timed else 0
    included = " ".join(facts.get("DATA_INCLUDED", []))
    width = _BODY_COLUMNS if "6D" in included else 3
    if width == 3 and "3D" not in included:
        raise MtmError(f"{path} is an export of Qualisys of {included or 'unknown'} data; export 6D or 3D data")
    table = read_table(path, content, "\t", lead + width * len(names), f"{width} for each of {len(names)} names")
    return _File(facts, timed, table, width)


def _names(facts: dict[str, list[str]], path: Path) -> list[str]:
    names = [name for name in facts.get("BODY_NAMES", facts.get("MARKER_NAMES", [])) if name]
    if not names:
        raise MtmError(
            f"{path} is an export of Qualisys whose header names no body or marker; export it with its header"
        )
    return names


def _times_s(path: Path, file: _File) -> Floats:
    values = file.table.values
    if file.timed:
        return np.asarray(values[:, 1])
    try:
        rate_hz = float(file.facts["FREQUENCY"][0].replace(",", "."))
    except (KeyError, IndexError, ValueError):
        rate_hz = np.nan
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise MtmError(f"{path} is an export of Qualisys without times and without a frequency; export it with them")
    return np.arange(len(values)) / rate_hz


def _bodies(file: _File, times_s: Floats, unit_m: float, options: ReadOptions) -> list[Body]:
    lead = 2 if file.timed else 0
    found = []
    for number, name in enumerate(name for name in file.facts["BODY_NAMES"] if name):
        block = file.table.values[:, lead + number * _BODY_COLUMNS :][:, :_BODY_COLUMNS]
        # Its matrices are written column by column.
        matrices = np.swapaxes(block[:, _MATRIX_FROM:].reshape(-1, 3, 3), 1, 2)
        unseen = np.all(block[:, :3] == 0.0, axis=1) & ~np.any(block[:, _MATRIX_FROM:], axis=1)
        positions_m = np.where(unseen[:, None], np.nan, block[:, :3] * unit_m)
        if np.any(np.isfinite(positions_m)):
            found.append(Body(name, times_s, positions_m, quaternions_of_matrices(matrices), up=options.up or "z"))
    return found


def _marked(path: Path, file: _File, times_s: Floats, unit_m: float, options: ReadOptions, warn: Warn) -> list[Body]:
    lead = 2 if file.timed else 0
    labels = _names(file.facts, path)
    markers = file.table.values[:, lead:].reshape(len(times_s), -1, 3) * unit_m
    markers = np.where(np.all(markers == 0.0, axis=2, keepdims=True), np.nan, markers)
    groups = grouped(labels, options.bodies, str(path))
    return [
        rigid_body(name, times_s, markers[:, members], options.up or "z", str(path), warn)
        for name, members in groups.items()
        if np.any(np.isfinite(markers[:, members]))
    ]


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"\s*[-+]?[\d.,]+([eE][-+]?\d+)?\s*", cell) is not None
