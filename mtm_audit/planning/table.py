"""Accuracy tables: how often one symbol was decoded correctly, by channel, alphabet size and window length.

A table is a CSV file with the header `channel,M,t,successes,trials`; lines that begin with # are comments. A channel
name such as `x+y` stands for channels that carry the same symbol together, their scores pooled.
"""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, read_text

COLUMNS = ("channel", "M", "t", "successes", "trials")
_POOLED = "+"
_LARGEST = {"M": 65_536, "t": 1 << 22, "successes": 10**9, "trials": 10**9}
_SMALLEST = {"M": 2, "t": 1, "successes": 0, "trials": 1}


@dataclass(frozen=True)
class AccuracyPoint:
    """One cell of a table: `successes` of `trials` symbols decoded correctly in windows of `window_ticks`.

    Raises MtmError on construction when the numbers cannot be.
    """

    channel: str
    alphabet_size: int
    window_ticks: int
    successes: int
    trials: int

    def __post_init__(self) -> None:
        numbers = (self.alphabet_size, self.window_ticks, self.successes, self.trials)
        for name, value in zip(COLUMNS[1:], numbers, strict=True):
            if not _SMALLEST[name] <= value <= _LARGEST[name]:
                raise MtmError(f"{name} is {value}; give {_SMALLEST[name]} to {_LARGEST[name]}")
        if self.successes > self.trials:
            raise MtmError(
                f"{self.successes} successes of {self.trials} trials would be an accuracy above 1; "
                "give at most as many successes as trials"
            )
        if not all(self.members) or len(set(self.members)) < len(self.members):
            raise MtmError(f"{self.channel!r} names no channels; give a name, or different names joined by {_POOLED}")

    @property
    def members(self) -> tuple[str, ...]:
        """The channels that carried the symbol: one, or those whose scores were pooled."""
        return members_of(self.channel)


@dataclass(frozen=True)
class AccuracyTable:
    """All points of a table, in its own order. Raises MtmError when empty or when a cell is given twice."""

    points: tuple[AccuracyPoint, ...]

    def __post_init__(self) -> None:
        if not self.points:
            raise MtmError("the accuracy table has no rows; measure at least one channel")
        seen = set()
        for point in self.points:
            cell = (frozenset(point.members), point.alphabet_size, point.window_ticks)
            if cell in seen:
                raise MtmError(
                    f"{point.channel} at M = {point.alphabet_size}, t = {point.window_ticks} stands twice in the "
                    "table; add up the successes and trials in one row"
                )
            seen.add(cell)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names in the order of their first row, pooled ones included."""
        return tuple(dict.fromkeys(point.channel for point in self.points))

    @property
    def alphabet_sizes(self) -> tuple[int, ...]:
        """Every M measured, ascending."""
        return tuple(sorted({point.alphabet_size for point in self.points}))

    def points_of(self, channel: str, alphabet_size: int) -> tuple[AccuracyPoint, ...]:
        """Points of one channel and alphabet by ascending window length; empty when none was measured."""
        wanted = frozenset(members_of(channel))
        found = [p for p in self.points if p.alphabet_size == alphabet_size and frozenset(p.members) == wanted]
        return tuple(sorted(found, key=lambda point: point.window_ticks))


def members_of(channel: str) -> tuple[str, ...]:
    """The channels behind a name of a table."""
    return tuple(channel.split(_POOLED))


def pooled_name(members: Iterable[str]) -> str:
    """The name of channels that carry the same symbol together."""
    return _POOLED.join(members)


def read_table(path: Path) -> AccuracyTable:
    """Read a table; raises MtmError with the line and what it should hold."""
    try:
        text = read_text(path, "the accuracy table").removeprefix("\ufeff")
        rows = [(number, row) for number, row in _numbered(text.splitlines()) if row]
    except (BrokenTextError, csv.Error) as error:
        raise MtmError(f"{path} is not a CSV file; give a table such as mtm-hil sweep writes") from error
    if not rows or tuple(cell.strip() for cell in rows[0][1]) != COLUMNS:
        raise MtmError(f"{path} does not begin with the header {','.join(COLUMNS)}; add it or name another file")
    points = []
    for number, row in rows[1:]:
        try:
            points.append(_point(row))
        except MtmError as error:
            raise MtmError(f"{path}, line {number}: {error}") from error
    try:
        return AccuracyTable(tuple(points))
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def write_table(path: Path, table: AccuracyTable, comments: Sequence[str] = ()) -> None:
    """Write a table after its comments, whole or not at all."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {comment}\n" for comment in comments)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for point in table.points:
            writer.writerow(
                (point.channel, point.alphabet_size, point.window_ticks, point.successes, point.trials)
            )  # fmt: skip


def _numbered(lines: Iterable[str]) -> Iterable[tuple[int, list[str]]]:
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.startswith("#"):
            yield number, next(csv.reader([line], strict=True))


def _point(row: Sequence[str]) -> AccuracyPoint:
    cells = dict(zip(COLUMNS, (cell.strip() for cell in row), strict=False))
    missing = [name for name in COLUMNS if not cells.get(name)]
    if missing:
        raise MtmError(f"{missing[0]} is missing; fill the cell, or leave the whole row out if it was not measured")
    if len(row) > len(COLUMNS):
        raise MtmError(f"there are {len(row)} cells; give the {len(COLUMNS)} of the header")
    numbers = []
    for name in COLUMNS[1:]:
        try:
            numbers.append(int(cells[name]))
        except ValueError as error:
            raise MtmError(f"{name} is {cells[name]!r}; give a whole number") from error
    return AccuracyPoint(cells["channel"], *numbers)
