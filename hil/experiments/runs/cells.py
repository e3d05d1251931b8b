"""Cells, the units of work of every experiment, and the file that keeps their results.

In `hil` the word cell has this meaning only.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from hil.experiments.runs.fingerprint import code_fingerprint
from mtm_onboard.protocol import MtmError

Scalar = str | int | float | bool
Values = Mapping[str, Scalar]
_LINE_BEGINS = b'{"code": '


@dataclass(frozen=True)
class Cell:
    """One unit of work: its result is a function of these three and of the code."""

    experiment: str
    parameters: Values
    seed: int

    @property
    def name(self) -> str:
        """A text that is the same for equal cells, whatever the order of their parameters."""
        return json.dumps([self.experiment, self.parameters, self.seed], sort_keys=True)


class CellStore:
    """Finished cells in a text file: one line of JSON each, with the fingerprint of the code that computed it.

    Lines of other code are kept and not used. A line is written in one piece and flushed to the disk, and a last line
    that an interrupt cut short is dropped when the file is opened again. Raises MtmError when the file cannot be used.
    """

    def __init__(self, path: Path, code: str | None = None) -> None:
        self._path = path
        self._code = code_fingerprint() if code is None else code
        self._finished: dict[str, Values] = {}
        if path.exists() and not path.is_file():
            raise MtmError(f"{path} is a folder, pipe or device; name a file for finished cells")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("ab+", buffering=0)
            self._load()
        except OSError as error:
            raise MtmError(f"cannot write {path}: {error.strerror}; choose a folder that is writable") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def find(self, cell: Cell) -> Values | None:
        """The result of a finished cell."""
        return self._finished.get(cell.name)

    def add(self, cell: Cell, result: Values) -> None:
        """Store a result and flush it to the disk."""
        entry = {"code": self._code, "cell": cell.name, "result": dict(result)}
        self._file.write(json.dumps(entry).encode() + b"\n")
        os.fsync(self._file.fileno())
        self._finished[cell.name] = result

    @classmethod
    def check(cls, path: Path) -> None:
        """Raise MtmError when what is at `path` is something else; meant for the time before the long work."""
        if os.path.lexists(path):
            with cls(path):
                pass

    def _load(self) -> None:
        self._file.seek(0)
        text = self._file.read()
        whole = text[: text.rfind(b"\n") + 1]
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                entry = json.loads(line)
                if entry["code"] == self._code:
                    self._finished[entry["cell"]] = entry["result"]
            except (ValueError, TypeError, KeyError) as error:
                raise self._foreign(number) from error
        # What follows the last whole line is cut off only where it is the beginning of another one: a file of something
        # else, such as a key, stays as it is.
        rest = text[len(whole) :]
        if rest[: len(_LINE_BEGINS)] != _LINE_BEGINS[: len(rest)]:
            raise self._foreign(whole.count(b"\n") + 1)
        if rest:
            self._file.truncate(len(whole))

    def _foreign(self, number: int) -> MtmError:
        self._file.close()
        return MtmError(f"{self._path}, line {number}, is no finished cell; name another file for --cells")
