"""A simulated serial CAN adapter: LAWICEL's ASCII protocol on a pseudo-terminal.

A program in another process opens `path` as python-can's `slcan` interface and finds a simulated robot there. The
protocol is that of the LAWICEL CANUSB manual: lines end in a carriage return, each is answered with a carriage
return when done and with a bell when refused.
"""

import os
import re
import tty
from collections import deque

import can

_LINE_END = b"\r"
_BELL = b"\a"
_LONGEST_LINE = 26  # T, 8 digits of id, 1 of length, 16 of data
_MAX_UNSENT_BYTES = 16_384  # an adapter's memory; frames beyond it are lost, as on a real one
_FRAME = re.compile(rb"(?:t([0-7][0-9A-Fa-f]{2})|T([01][0-9A-Fa-f]{7}))([0-8])((?:[0-9A-Fa-f]{2})*)")
_SETTING = re.compile(rb"S[0-8]|s[0-9A-Fa-f]{4}")


class SlcanPort:
    """The adapter. The simulator's side is bus-like: `send`, `recv` (which never waits) and `shutdown`.

    Frames pass while the other side has the channel open. `lost_frames` counts what it was too slow to read,
    `refused_lines` what it was answered with a bell. An adapter that `rejects` answers each frame so, as one does whose
    frames nobody on the bus acknowledges.
    """

    def __init__(self) -> None:
        self.rejects = False
        self.lost_frames = 0
        self.refused_lines = 0
        self._ours, self._theirs = os.openpty()
        # Their end stays open here too, so that the line outlives the program at the other end.
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)
        self._is_shut_down = False
        self._is_open = False
        self._listens_only = False
        self._line = bytearray()
        self._unsent = bytearray()
        self._received: deque[can.Message] = deque()

    @property
    def is_open(self) -> bool:
        """Whether the other side has opened the channel."""
        return self._is_open

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Pass a frame to the other side; lost when the channel is closed or nobody reads. Never waits."""
        if not self._is_open:
            return
        if len(self._unsent) > _MAX_UNSENT_BYTES:
            self.lost_frames += 1
        else:
            head = f"T{msg.arbitration_id:08X}" if msg.is_extended_id else f"t{msg.arbitration_id:03X}"
            self._unsent += f"{head}{msg.dlc}{msg.data.hex().upper()}\r".encode()
        self._flush()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame from the other side, or None. Never waits."""
        if not self._received:
            self._pump()
        return self._received.popleft() if self._received else None

    @property
    def descriptor(self) -> int:
        """The simulator's end, readable when the other side has sent something; frames may wait here nevertheless."""
        return self._ours

    def shutdown(self) -> None:
        """Close the line; safe to call more than once."""
        if not self._is_shut_down:
            self._is_shut_down = True
            os.close(self._ours)
            os.close(self._theirs)

    def _pump(self) -> None:
        try:
            data = os.read(self._ours, 65_536)
        except BlockingIOError:
            data = b""
        for value in data:
            if value == _LINE_END[0]:
                self._unsent += self._obey(bytes(self._line))
                self._line.clear()
            elif len(self._line) <= _LONGEST_LINE:
                self._line.append(value)
        self._flush()

    def _flush(self) -> None:
        if self._unsent:
            try:
                written = os.write(self._ours, self._unsent)
            except BlockingIOError:
                return
            del self._unsent[:written]

    def _obey(self, line: bytes) -> bytes:
        """Do what `line` says and return the answer."""
        answer = self._answer(line)
        self.refused_lines += answer == _BELL
        return answer

    def _answer(self, line: bytes) -> bytes:
        command = line[:1]
        if command in (b"t", b"T"):
            return self._take_frame(line)
        if line in (b"O", b"L") and not self._is_open:
            self._is_open = True
            self._listens_only = line == b"L"
        elif line == b"C" and self._is_open:
            self._is_open = False
        elif line == b"V":
            return b"V1013\r"
        elif line == b"N":
            return b"N0001\r"
        elif line == b"F" and self._is_open:
            return b"F00\r"
        elif line not in (b"", b"Z0") and (self._is_open or not _SETTING.fullmatch(line)):
            return _BELL
        return _LINE_END

    def _take_frame(self, line: bytes) -> bytes:
        match = _FRAME.fullmatch(line)
        if match is None or len(match[4]) != 2 * int(match[3]) or not self._is_open:
            return _BELL
        if self._listens_only or self.rejects:
            return _BELL
        number = int(match[1] or match[2], 16)
        self._received.append(
            can.Message(
                arbitration_id=number, is_extended_id=match[1] is None, data=bytearray.fromhex(match[4].decode())
            )
        )
        return b"z\r" if match[1] else b"Z\r"
