"""A file that another program may still be writing, read as it grows."""

import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from mtm_audit.live.events import Event, Quiet
from mtm_audit.live.poses import PoseLines
from mtm_audit.live.timeline import Timeline
from mtm_onboard.protocol.input_file import opened

# A file that has not grown for so long is finished.
PATIENCE_S = 10.0
_PAUSE_S = 0.1
_BLOCK_BYTES = 1 << 16

Sleep = Callable[[float], None]


class GrowingFile(io.RawIOBase):
    """Bytes of a file; at its end a read waits for more, and gives nothing once it has not grown for a while.

    Raises MtmError when the file cannot be opened.
    """

    def __init__(self, path: Path, patience_s: float = PATIENCE_S, sleep: Sleep = time.sleep) -> None:
        self._opened = opened(path, "the recording")
        self._file = self._opened.__enter__()
        self.name = str(path)
        self._patience_s, self._sleep = patience_s, sleep
        self._is_finished = False

    def readable(self) -> bool:
        """Always."""
        return True

    def seekable(self) -> bool:
        """Always."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go elsewhere in what is written so far."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Where the next read begins."""
        return self._file.tell()

    def read(self, size: int = -1) -> bytes:
        """Up to so many bytes, as soon as there are any; none at the end of a finished file."""
        waited_s = 0.0
        while not (data := self._file.read(size)) and not self._is_finished:
            if waited_s >= self._patience_s:
                self._is_finished = True
                break
            self._sleep(_PAUSE_S)
            waited_s += _PAUSE_S
        return bytes(data)

    def close(self) -> None:
        """Let go of the file."""
        self._opened.__exit__(None, None, None)
        super().close()


def growing_poses(path: Path, patience_s: float = PATIENCE_S, sleep: Sleep = time.sleep) -> Iterator[Event]:
    """The poses in the lines of a file that may still grow; its times are those of the lines."""
    lines, rest = PoseLines(Timeline(is_live=False), str(path)), b""
    with GrowingFile(path, patience_s, sleep) as file:
        while data := file.read(_BLOCK_BYTES):
            *whole, rest = (rest + data).split(b"\n")
            yield from lines.events((line.decode("utf-8", "replace") for line in whole), 0.0)
            yield Quiet()
        yield from lines.events([rest.decode("utf-8", "replace")], 0.0)
