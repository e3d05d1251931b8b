"""Base commands one a datagram: over a Unix socket, which has permissions, or over a loopback UDP port, which has none.

One sender at a time drives the robot: the first keeps it until it has been silent, and what others send meanwhile is
counted. A stop is taken from anybody. Each poll reads everything that had come before it, so no stop waits behind
velocities.
"""

import socket
import struct
from abc import abstractmethod
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.base_command import LONGEST_BYTES, StopRequest, parse
from mtm_onboard.runtime.socket_file import SocketFile
from mtm_onboard.runtime.source import Command, TextSource

# By then the robot stands still for want of commands, unless it was told to wait for longer.
SILENT_S = 0.5
# Members of the sockets' group may drive the robot, and nobody else.
_MODE = 0o660
# What the port's buffer holds of the shortest datagrams, and a few that come while it is read, some 5 ms of reading.
_BUFFER_BYTES = 1 << 19
_MOST_READS = 1500
# SO_MEMINFO of Linux (asm-generic/socket.h) gives nine counters; the last is of dropped datagrams (linux/sock_diag.h).
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("9I")
_MEMINFO_DROPS = 8
_CREDENTIALS = struct.Struct("3i")
_ANCILLARY_BYTES = socket.CMSG_SPACE(_CREDENTIALS.size)


class _DatagramSource(TextSource):
    """Takes in the datagrams of `endpoint`, which does not block."""

    def __init__(self, endpoint: socket.socket) -> None:
        super().__init__()
        self._socket = endpoint
        self._socket.setblocking(False)

    def poll(self, now_s: float) -> Command:
        """Drain the socket; the last good command of the sender that drives the robot wins."""
        arrived_s = self._arrival_s(now_s)
        try:
            for _ in range(_MOST_READS):
                text, ancillary, _, address = self._socket.recvmsg(LONGEST_BYTES + 1, _ANCILLARY_BYTES)
                self._take_from(self._sender(ancillary, address), text, arrived_s)
        except OSError:
            # Nothing left, or a socket that fails: either way no command came, and the last one goes on ageing.
            pass
        return self._newest

    @abstractmethod
    def _sender(self, ancillary: list[tuple[int, int, bytes]], address: Any) -> str:
        """Who sent a datagram, in words."""

    def _take_from(self, sender: str, text: bytes, arrived_s: float) -> None:
        try:
            command = parse(text)
        except MtmError:
            self.refused += 1
            return
        if isinstance(command, StopRequest):
            self._newest = self._newest._replace(stop=True)
        elif sender == self.sender or not self.sender or arrived_s - self._newest.arrived_s > SILENT_S:
            self.sender = sender
            self._newest = Command(command, arrived_s, self._newest.stop)
        else:
            self.intruder = sender
            self.intrusions += 1


class UnixSource(_DatagramSource):
    """A Unix datagram socket at `path` that its owner and its group may send to; senders are processes.

    A sender waits while the queue is full, so nothing is ever lost. Raises MtmError when the socket cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._file = SocketFile(path, socket.SOCK_DGRAM, _MODE, "socket for base commands")
        self._file.socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        super().__init__(self._file.socket)

    def close(self) -> None:
        """Remove the socket."""
        self._file.close()

    def _sender(self, ancillary: list[tuple[int, int, bytes]], address: Any) -> str:
        for level, kind, data in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, socket.SCM_CREDENTIALS):
                return f"process {_CREDENTIALS.unpack(data)[0]}"
        return "an unknown process"


class UdpSource(_DatagramSource):
    """A loopback UDP port, which every user of this host may send to; `port` 0 takes a free one, found in `port`.

    The system drops what comes when the port's buffer is full. A stop may have been among that, so it counts as one;
    `lost` says how many datagrams it was. Raises MtmError when the port cannot be had.
    """

    def __init__(self, port: int) -> None:
        endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            endpoint.bind(("127.0.0.1", port))
        except OSError as error:
            endpoint.close()
            raise MtmError(f"cannot listen on UDP port {port}: {error.strerror}; choose another port") from error
        # The system may grant less.
        endpoint.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        super().__init__(endpoint)
        self.port: int = endpoint.getsockname()[1]

    def poll(self, now_s: float) -> Command:
        """As the others do; the loss of a datagram is a stop."""
        super().poll(now_s)
        lost = self._dropped()
        if lost != self.lost:
            self.lost = lost
            if not self._newest.stop:
                self.stop_reason = (
                    f"{lost} datagrams came faster than they are read, and a stop may have been among them"
                )
            self._newest = self._newest._replace(stop=True)
        return self._newest

    def close(self) -> None:
        """Release the port."""
        self._socket.close()

    def _dropped(self) -> int:
        try:
            counters = self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
            return int(_MEMINFO.unpack(counters)[_MEMINFO_DROPS])
        except (OSError, struct.error):
            # Another system than Linux, which does not tell.
            return self.lost

    def _sender(self, ancillary: list[tuple[int, int, bytes]], address: Any) -> str:
        return f"UDP port {address[1]}"
