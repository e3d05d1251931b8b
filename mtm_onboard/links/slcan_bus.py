"""A serial CAN adapter (LAWICEL's ASCII protocol) that one program has for itself, and whose answers are counted.

python-can's own bus shares the serial line with whoever else opens it, so that two programs each get half of the
robot's attention; it passes over what the adapter answers to a frame, and it asks the system for each byte by itself,
which at a robot's 300 bytes of telemetry each 20 ms keeps the interpreter from the loop.
"""

import fcntl
import os
import re
import select
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    import can

_LINE_END = re.compile(b"([\r\a])")
_LONGEST_LINE = 64
_READ_BYTES = 4096
_BELL = "\a"
_TAKEN = ("\r", "z\r", "Z\r")


class SlcanBus:
    """python-can's bus on `channel`, a serial port with or without "@" and a baud rate; `options` are python-can's.

    `answers` counts what the adapter said to frames. Raises MtmError when another program has the port, and
    python-can's errors when it cannot be opened.
    """

    def __init__(self, channel: str, **options: Any) -> None:
        self._lock_descriptor = _locked(channel)
        try:
            self._bus, self.answers, self._lines = _opened(channel, options)
        except BaseException:
            self._unlock()
            raise
        self.serialPortOrig = self._bus.serialPortOrig  # type: ignore[attr-defined]
        # After each frame python-can would wait, without bound, until the last byte has left.
        self.serialPortOrig.flush = lambda: None
        self.send = self._bus.send
        self.recv = self._bus.recv
        self.fileno = self._bus.fileno

    @property
    def has_waiting(self) -> bool:
        """Whether frames, or answers, were read from the port and not yet received."""
        return bool(self._lines)

    def shutdown(self) -> None:
        """Close the channel and the port, and leave them to others, also when the adapter is gone."""
        try:
            self._bus.shutdown()
        finally:
            self._unlock()

    def _unlock(self) -> None:
        descriptor, self._lock_descriptor = self._lock_descriptor, None
        if descriptor is not None:
            os.close(descriptor)


class AdapterAnswers:
    """What a serial adapter has answered to frames: how many it `rejected`, with a bell, and how many it `took`.

    Some answer nothing to a frame that they take. The first answers belong to the `settings` before any frame:
    python-can closes what is closed and opens what is open, which adapters reject, and no frame was lost.
    """

    def __init__(self) -> None:
        self.rejected = self.took = self.settings = 0

    def take(self, line: str) -> None:
        """Count one line from the adapter, whatever it is."""
        is_bell = line.endswith(_BELL)
        if not is_bell and line not in _TAKEN:
            return
        if self.settings:
            self.settings -= 1
        else:
            self.rejected += is_bell
            self.took += not is_bell


def _opened(channel: str, options: dict[str, Any]) -> "tuple[can.BusABC, AdapterAnswers, deque[str]]":
    """The bus, what its adapter answers, and the lines that it has read and not yet received."""
    from can.interfaces.slcan import slcanBus

    answers, lines = AdapterAnswers(), deque[str]()

    class CountingBus(slcanBus):
        _is_setting_up = True

        def _read(self, timeout: float | None) -> str | None:
            descriptor = self.serialPortOrig.fileno()
            if not lines and select.select([descriptor], (), (), timeout)[0]:
                data = os.read(descriptor, _READ_BYTES)
                if not data:
                    raise OSError("the adapter is gone")
                self._buffer += data
                *whole, rest = _LINE_END.sub(rb"\1\n", self._buffer).split(b"\n")
                lines.extend(line.decode("ascii", "replace") for line in whole)
                self._buffer[:] = rest[-_LONGEST_LINE:]
            if not lines:
                return None
            answers.take(lines[0])
            return lines.popleft()

        def _write(self, string: str) -> None:
            answers.settings += self._is_setting_up
            super()._write(string)

    bus = CountingBus(channel, **options)
    bus._is_setting_up = False
    return bus, answers, lines


def _locked(channel: str) -> int | None:
    """A descriptor that holds the port's lock, as pyserial's exclusive lines do; None for what is no device file."""
    path = str(channel).split("@")[0]
    with suppress(OSError):  # python-can then says why it cannot be opened
        # Before python-can opens it, which would close the other program's channel on the way.
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise MtmError(
                f"The CAN adapter {path} is in use by another program; end that one, since a robot obeys one at a time."
            ) from None
        return descriptor
    return None
