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
# Of so many datagrams in one tick all are parsed; of a flood, the stops and the newest good command are what matters.
_ALL_PARSED = 64
# What the port's buffer holds of the shortest datagrams, and a few that come while it is read.
_BUFFER_BYTES = 1 << 19
_MOST_PORT_READS = 1500
# What a queue of Linux holds unless somebody has raised it, and a few that come while it is read.
_QUEUE_LENGTH = Path("/proc/sys/net/unix/max_dgram_qlen")
_USUAL_QUEUE_LENGTH = 512
_MORE_READS = 8
# SO_MEMINFO of Linux (asm-generic/socket.h) gives nine counters; the last is of dropped datagrams (linux/sock_diag.h).
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("9I")
_MEMINFO_DROPS = 8
_CREDENTIALS = struct.Struct("3i")
_ANCILLARY_BYTES = socket.CMSG_SPACE(_CREDENTIALS.size)

# A sender as the system tells it, and what it sent.
Datagram = tuple[Any, bytes]


class _DatagramSource(TextSource):
    """Takes in the datagrams of `endpoint`, which does not block: at most `most_reads` in a poll.

    That is more than the system holds, so whatever had come before a poll is read by it.
    """

    def __init__(self, endpoint: socket.socket, most_reads: int) -> None:
        super().__init__()
        self._socket = endpoint
        self._socket.setblocking(False)
        self._most_reads = most_reads
        self._driver: Any = None

    def poll(self, now_s: float) -> Command:
        """Drain the socket; the last good command of the sender that drives the robot wins."""
        arrived_s = self._arrival_s(now_s)
        datagrams = self._drained()
        if len(datagrams) > _ALL_PARSED:
            datagrams = self._essence(datagrams)
        for sender, text in datagrams:
            self._take_from(sender, text, arrived_s)
        return self._newest

    def _drained(self) -> list[Datagram]:
        datagrams: list[Datagram] = []
        try:
            for _ in range(self._most_reads):
                datagrams.append(self._received())
        except OSError:
            # Nothing left, or a socket that fails: either way no command came, and the last one goes on ageing.
            pass
        return datagrams

    @abstractmethod
    def _received(self) -> Datagram:
        """The next datagram; raises OSError when there is none."""

    @abstractmethod
    def _called(self, sender: Any) -> str:
        """A sender in words."""

    def _essence(self, datagrams: list[Datagram]) -> list[Datagram]:
        """Those of a flood that need be parsed: what may be a stop, and the newest ones."""
        older, newest = datagrams[:-_ALL_PARSED], datagrams[-_ALL_PARSED:]
        driver = self._driver
        stops = [datagram for datagram in older if b"stop" in datagram[1]]
        if driver is not None:
            self.intrusions += sum(sender != driver and b"stop" not in text for sender, text in older)
        # The driver's newest may be among the older ones when others flood.
        own = next((datagram for datagram in reversed(older) if datagram[0] == driver), None)
        return [*stops, *([own] if own is not None else []), *newest]

    def _take_from(self, sender: Any, text: bytes, arrived_s: float) -> None:
        try:
            command = parse(text)
        except MtmError:
            self.refused += 1
            return
        if isinstance(command, StopRequest):
            self._newest = self._newest._replace(stop=True)
        elif sender == self._driver or self._driver is None or arrived_s - self._newest.arrived_s > SILENT_S:
            if sender != self._driver:
                self._driver, self.sender = sender, self._called(sender)
            self._newest = Command(command, arrived_s, self._newest.stop)
        else:
            self.intruder = self._called(sender)
            self.intrusions += 1


class UnixSource(_DatagramSource):
    """A Unix datagram socket at `path` that its owner and its group may send to; senders are processes.

    A sender waits while the queue is full, so nothing is ever lost. Raises MtmError when the socket cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._file = SocketFile(path, socket.SOCK_DGRAM, _MODE, "socket for base commands")
        self._file.socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        super().__init__(self._file.socket, _queue_length() + _MORE_READS)

    def close(self) -> None:
        """Remove the socket."""
        self._file.close()

    def _received(self) -> Datagram:
        text, ancillary, _, _ = self._socket.recvmsg(LONGEST_BYTES + 1, _ANCILLARY_BYTES)
        return (ancillary[0][2] if ancillary else b""), text

    def _called(self, sender: bytes) -> str:
        return f"process {_CREDENTIALS.unpack(sender)[0]}" if sender else "an unknown process"


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
        super().__init__(endpoint, _MOST_PORT_READS)
        self.port: int = endpoint.getsockname()[1]

    def poll(self, now_s: float) -> Command:
        """As the others do; the loss of a datagram is a stop."""
        super().poll(now_s)
        lost = self._dropped()
        if lost != self.lost:
            self.lost = lost
            if not self._newest.stop:
                self.stop_reason = f"{lost} datagrams came faster than they are read, and one may have been a stop"
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

    def _received(self) -> Datagram:
        text, address = self._socket.recvfrom(LONGEST_BYTES + 1)
        return address, text

    def _called(self, sender: tuple[str, int]) -> str:
        return f"UDP port {sender[1]}"


def _queue_length() -> int:
    """How many datagrams a Unix socket holds at most."""
    try:
        return int(_QUEUE_LENGTH.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return _USUAL_QUEUE_LENGTH
