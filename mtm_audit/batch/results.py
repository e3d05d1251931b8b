"""The table of a batch on disk: grows by one recording at a time, is mended after a kill, and ends in order."""

import fcntl
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from mtm_audit.batch.row import Row, header, lines_of, row_of
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.output_file import check_outputs

COMMAND = "mtm-audit batch"

Rows = tuple[Row, ...]


def check_results(path: Path, *, force: bool) -> None:
    """Raise MtmError, before any work, when there is a file at `path` that no batch made and nothing forces it away."""
    check_outputs(COMMAND, path, force=force, begins=(header().encode(),))


class ResultsFile:
    """The rows of each recording by its name, which are on disk as soon as `add` returns.

    Only rows of this `run`, of the recordings `names`, are taken over from an earlier one. Raises MtmError when there
    are others, unless `force` lets them go, and while another program writes to the file.
    """

    def __init__(self, path: Path, run: str, names: Iterable[str], *, force: bool) -> None:
        check_results(path, force=force)
        self._path = path
        self._open = ExitStack()
        wanted = frozenset(names)
        try:
            self._lock()
            earlier = _rows_in(path)
            self.kept: Mapping[str, Rows] = {
                name: rows for name, rows in earlier.items() if name in wanted and all(row.run == run for row in rows)
            }
            if len(self.kept) < len(earlier) and not force:
                raise MtmError(_loss(path, earlier, wanted))
            self._rows = dict(self.kept)
            self._write(self._rows.values())
            # The lock is on what was written over.
            self._open.close()
            self._file = self._lock()
        except BaseException:
            self._open.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def add(self, name: str, rows: Rows) -> None:
        """Append the rows of one recording, in the place of earlier ones of it."""
        _write_all(self._file, lines_of(rows).encode())
        os.fsync(self._file)
        self._rows[name] = rows

    def finish(self, names: Sequence[str]) -> tuple[Rows, ...]:
        """Write the rows of all `names` in that order; returns them."""
        ordered = tuple(self._rows[name] for name in names)
        self._write(ordered)
        return ordered

    def _lock(self) -> int:
        """Keep other programs away until the stack is closed; returns a descriptor that appends."""
        descriptor = os.open(self._path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
        self._open.callback(os.close, descriptor)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise MtmError(f"another program is writing {self._path}; wait for it, or name another file") from error
        return descriptor

    def _write(self, groups: Iterable[Rows]) -> None:
        with replacing(self._path) as temporary:
            temporary.write_text(header() + "".join(map(lines_of, groups)), encoding="utf-8")


def _rows_in(path: Path) -> dict[str, Rows]:
    """The rows of each recording all of whose rows are whole; of several turns the last. A half line is left out."""
    text = path.read_bytes().decode("utf-8", errors="replace")
    if not text.startswith(header()):
        return {}
    found: dict[str, Rows] = {}
    group: list[Row] = []
    for line in text.split("\n")[1:-1]:
        row = row_of(line)
        if row is None or (group and (row.path, row.rows) != (group[0].path, group[0].rows)):
            group = []
        if row is None:
            continue
        group.append(row)
        if str(len(group)) == row.rows:
            found[row.path] = tuple(group)
            group = []
    return found


def _loss(path: Path, earlier: Mapping[str, Rows], wanted: frozenset[str]) -> str:
    others = sorted(earlier.keys() - wanted)
    if others:
        return (
            f"{path} has rows of recordings that are not named now, such as {others[0]}; name them too, choose another "
            "file, or let those rows go with --force"
        )
    return (
        f"{path} has rows that were made with other keys, options or another version; choose another file, or make "
        "them anew with --force"
    )


def _write_all(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]
