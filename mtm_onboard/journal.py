"""The journal: what was commanded, tick by tick, as comma-separated text that survives a crash.

The first line is `# ` and the header in JSON, the second names the columns, and each further line is a tick. A full
or failing disk costs rows, which are counted, and never a tick.
"""

import io
import json
import threading
from collections import deque
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.motion import BodyVelocity
from mtm_onboard.protocol.errors import MtmError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

COLUMNS = (
    "tick", "time_s", "base_vx_mps", "base_vy_mps", "base_wz_radps", "sent_vx_mps", "sent_vy_mps", "sent_wz_radps",
    "lateness_s", "flags",
)  # fmt: skip
_MOST_WAITING = 60_000
_INLINE_BATCH = 500
_WRITE_PERIOD_S = 0.1
_Row = tuple[int, float, BodyVelocity, BodyVelocity, int]


@dataclass(frozen=True)
class JournalHeader:
    """What the rows belong to. `symbols` is the whole message, None when only base commands were sent.

    `start_s` is tick 0 on the runtime's clock and `start_unix_s` the same instant in seconds since the Unix epoch,
    None in simulated time. The secret is not here.
    """

    fingerprint: str
    key_id: str
    robot: str
    channel: str
    symbols: tuple[int, ...] | None
    repeat: bool
    rate_hz: float
    start_s: float
    start_unix_s: float | None


@dataclass(frozen=True)
class JournalRecord:
    """A journal read back: n rows. `base` and `sent` are (n, 3): vx, vy in m/s and wz in rad/s.

    `flags` are the bits of `mtm_onboard.guard`; `damaged` counts lines that could not be read.
    """

    header: JournalHeader
    ticks: Integers
    times_s: Floats
    base: Floats
    sent: Floats
    lateness_s: Floats
    flags: Integers
    damaged: int


class Journal:
    """Writes one file; `threaded` hands the writing to a thread, as real time needs, and else `append` does it.

    An existing file is kept: the new one gets the next free number before its suffix, see `path`.
    Raises MtmError when the file cannot be opened.
    """

    def __init__(self, path: Path, header: JournalHeader, *, threaded: bool) -> None:
        # Two counts, since two threads count.
        self._overrun = self._unwritten = 0
        self._header = header
        self._waiting: deque[_Row] = deque()
        self._torn = False
        self.path, self._file = _open_new(path)
        self._write((f"# {json.dumps(asdict(header))}\n" + ",".join(COLUMNS) + "\n").encode())
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True) if threaded else None
        if self._thread is not None:
            self._thread.start()

    @property
    def lost(self) -> int:
        """Rows that found the queue full or could not be written."""
        return self._overrun + self._unwritten

    def append(self, tick: int, now_s: float, base: BodyVelocity, sent: BodyVelocity, flags: int) -> None:
        """Keep one tick for writing; a row that finds the queue full is lost and counted."""
        waiting = self._waiting
        if len(waiting) >= _MOST_WAITING:
            self._overrun += 1
            return
        waiting.append((tick, now_s, base, sent, flags))
        if self._thread is None and len(waiting) >= _INLINE_BATCH:
            self._drain()

    def close(self) -> None:
        """Write what waits and close the file; safe to call more than once."""
        if self._file.closed:
            return
        if self._thread is not None:
            self._ending.set()
            self._thread.join()
        self._drain()
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        while not self._ending.wait(_WRITE_PERIOD_S):
            self._drain()

    def _drain(self) -> None:
        lines = []
        while self._waiting:
            tick, now_s, base, sent, flags = self._waiting.popleft()
            lateness_s = now_s - self._header.start_s - tick / self._header.rate_hz
            speeds = ",".join(f"{value:.9g}" for value in (*base, *sent))
            lines.append(f"{tick},{now_s:.6f},{speeds},{lateness_s:.6f},{flags}\n")
        if lines:
            self._write("".join(lines).encode())

    def _write(self, text: bytes) -> None:
        # After a write that was cut short the next one begins on a line of its own.
        begun = b"\n" if self._torn else b""
        try:
            done = self._file.write(begun + text)
        except OSError:
            done = 0
        written = max(0, done - len(begun))
        self._unwritten += text[written:].count(b"\n")
        self._torn = done < len(begun + text) and (self._torn or done > 0)


def _open_new(path: Path) -> tuple[Path, io.FileIO]:
    number = 1
    free = path
    while True:
        try:
            return free, free.open("xb", buffering=0)
        except FileExistsError:
            number += 1
            free = path.with_stem(f"{path.stem}-{number}")
        except OSError as error:
            raise MtmError(f"cannot write the journal {free}: {error.strerror}; choose a folder that exists") from error


def read_journal(path: Path) -> JournalRecord:
    """Read a journal; lines that a full disk or a crash left damaged are skipped and counted.

    Raises MtmError when the file cannot be read or has no header.
    """
    try:
        first, _, *lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
        table = json.loads(first.removeprefix("# "))
        symbols = table.pop("symbols")
        header = JournalHeader(symbols=None if symbols is None else tuple(symbols), **table)
    except OSError as error:
        raise MtmError(f"cannot read the journal {path}: {error.strerror}; check the name") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise MtmError(f"{path} does not begin like a journal; name a file that mtm-onboard run wrote") from error
    rows = [row for row in map(_numbers, lines[:-1]) if row is not None]
    damaged = len([line for line in lines if line]) - len(rows)
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS))
    return JournalRecord(
        header, columns[:, 0].astype(np.int64), columns[:, 1], columns[:, 2:5], columns[:, 5:8], columns[:, 8],
        columns[:, 9].astype(np.int64), damaged,
    )  # fmt: skip


def _numbers(line: str) -> list[float] | None:
    parts = line.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        return None
    return numbers if len(numbers) == len(COLUMNS) and np.isfinite(numbers).all() else None
