"""CSV exports of Vicon Tracker and Nexus: blocks of objects, segments or trajectories, each with its rate."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import METRES, ReadOptions
from mtm_audit.readers.logs.orientation import quaternions_of_rotation_vectors
from mtm_audit.readers.logs.rigid import grouped, rigid_body
from mtm_audit.readers.logs.table import Line, cells_of, check_rows, read_table, separator_of
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

_BODIES, _MARKERS = ("objects", "segments"), ("trajectories",)
_TITLES = (*_BODIES, *_MARKERS, "joints", "devices", "model outputs")
_NAME_STARTS = re.compile(r"^global (?:angle|position|translation|rotation)\s+", re.IGNORECASE)


@dataclass(frozen=True)
class _Block:
    title: str
    rate_hz: float
    names: list[str]
    axes: list[str]
    units: list[str]
    rows: list[Line]


def recognises_vicon(opening: Opening) -> bool:
    """Whether the first line is a title of Vicon's and the second a rate."""
    lines = [line.strip().strip(",;\t").lower() for line in opening.lines[:2]]
    return len(lines) == 2 and lines[0] in _TITLES and re.fullmatch(r"\d+([.,]\d+)?", lines[1]) is not None


def read_vicon(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The objects or segments, or else bodies of named markers; frames over the rate are times, the z axis points up.

    Rotations of objects are helical: a vector along the axis, as long as the angle. An empty cell, and a pose of
    zeros alone, is unseen. Raises MtmError when there is none.
    """
    blocks = list(_blocks(path, read_lines(path)))
    bodies = [body for block in blocks if block.title in _BODIES for body in _bodies(path, block, options)]
    if not bodies or options.bodies:
        bodies = [b for block in blocks if block.title in _MARKERS for b in _marked(path, block, options, warn)]
    if not bodies:
        raise MtmError(
            f"{path} is an export of Vicon's with {', '.join(block.title for block in blocks)} and no position; export "
            "objects or trajectories"
        )
    return Log(tuple(bodies))


def _blocks(path: Path, lines: list[str]) -> Iterator[_Block]:
    numbered = list(enumerate(lines, 1))
    starts = [n for n, line in numbered if line.strip().strip(",;\t").lower() in _TITLES]
    for start, end in zip(starts, [*starts[1:], len(lines) + 1], strict=True):
        title = lines[start - 1].strip().strip(",;\t").lower()
        head = lines[start : start + 4]
        if len(head) < 4:
            raise MtmError(f"{path}, line {start}: {title} end within their header; export it again")
        separator = separator_of(head[2]) or ","
        try:
            rate, names, axes, units = (cells_of(line, separator) for line in head)
            rate_hz = float(rate[0].replace(",", "."))
        except (ValueError, IndexError) as error:
            raise MtmError(f"{path}, line {start + 1}: a header of {title} that is broken; export it again") from error
        if not (np.isfinite(rate_hz) and rate_hz > 0.0):
            raise MtmError(f"{path}, line {start + 1}: a rate of {rate_hz:g} a second; export it again")
        width = len(axes)
        rows = [(number, line) for number, line in numbered[start + 4 : end - 1] if line.strip().strip(",;\t")]
        yield _Block(
            title, rate_hz, _filled((names + [""] * width)[:width]), [axis.lower() for axis in axes],
            [unit.lower() for unit in (units + [""] * width)[:width]], rows,
        )  # fmt: skip


def _filled(names: list[str]) -> list[str]:
    """Names stand above the first of their columns alone."""
    current, filled = "", []
    for name in names:
        current = name or current
        filled.append(_NAME_STARTS.sub("", current))
    return filled


def _table(path: Path, block: _Block) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Times from the frames, and all values."""
    separator = separator_of(block.rows[0][1]) if block.rows else ","
    table = read_table(path, block.rows, separator, len(block.axes), "the cells of the header")
    # Sub-frames count samples of devices within a frame and are 0 for what cameras see.
    return (table.values[:, 0] - table.values[0, 0]) / block.rate_hz, table.values, table.lines


def _triple(block: _Block, name: str, axes: tuple[str, str, str]) -> list[int]:
    here = [index for index in range(2, len(block.axes)) if block.names[index] == name]
    found = [next((index for index in here if block.axes[index] == axis), -1) for axis in axes]
    return [] if -1 in found else found


def _metres(block: _Block, columns: list[int], options: ReadOptions) -> float:
    unit = block.units[columns[0]]
    return options.metres(unit if unit in METRES else "mm")


def _bodies(path: Path, block: _Block, options: ReadOptions) -> Iterator[Body]:
    times_s, values, lines = _table(path, block)
    for name in dict.fromkeys(name for name in block.names[2:] if name):
        place = _triple(block, name, ("tx", "ty", "tz"))
        turn = _triple(block, name, ("rx", "ry", "rz"))
        if not place:
            continue
        positions_m = values[:, place] * _metres(block, place, options)
        positions_m[np.all(values[:, place] == 0.0, axis=1)] = np.nan
        check_rows(path, lines, times_s, positions_m)
        quaternions = None
        if turn:
            scale = np.deg2rad(1.0) if block.units[turn[0]].startswith("deg") else 1.0
            quaternions = quaternions_of_rotation_vectors(values[:, turn] * scale)
        yield Body(_short(name), times_s, positions_m, quaternions_xyzw=quaternions, up=options.up or "z")


def _marked(path: Path, block: _Block, options: ReadOptions, warn: Warn) -> Iterator[Body]:
    times_s, values, lines = _table(path, block)
    labels = [n for n in dict.fromkeys(block.names[2:]) if n and _triple(block, n, ("x", "y", "z"))]
    for name, members in grouped(labels, options.bodies, str(path)).items():
        places = [_triple(block, labels[m], ("x", "y", "z")) for m in members]
        markers_m = np.stack([values[:, place] * _metres(block, place, options) for place in places], axis=1)
        check_rows(path, lines, times_s, markers_m.reshape(len(times_s), -1))
        if np.any(np.isfinite(markers_m)):
            yield rigid_body(name, times_s, markers_m, options.up or "z", str(path), warn)


def _short(name: str) -> str:
    """The object of "object:root segment", which Tracker calls alike."""
    subject, _, segment = name.partition(":")
    return subject if subject and (segment == subject or not segment) else name
