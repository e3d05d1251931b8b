"""A stream of bytes to a robot, over a serial line or TCP, that never makes its user wait longer than it agreed to."""

import fcntl
import os
import select
import socket
import struct
import termios
import time
from collections.abc import Callable
from contextlib import suppress

from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command

_CONNECT_WITHIN_S = 3.0
_DELIVER_WITHIN_S = 0.2
_READ_BYTES = 4096
_READS_AT_ONCE = 16  # so that a babbling far end cannot hold its reader for ever
# So that commands which nobody reads cannot pile up in this host and be obeyed late; the kernel doubles it.
_SEND_BUFFER_BYTES = 2048


class ByteStream:
    """The open `descriptor` of a stream, which it makes non-blocking; `release` closes it.

    A message that has left in part is finished before the next one, so that the far end never meets half a message
    with another one behind it. Of a message that has not begun to leave nothing is kept. Use it under a lock when
    several threads do.
    """

    def __init__(self, descriptor: int, release: Callable[[], None] | None = None) -> None:
        os.set_blocking(descriptor, False)
        self.sent_bytes = 0
        self.received_bytes = 0
        self._descriptor = descriptor
        self._release = release or (lambda: os.close(descriptor))
        self._unsent = bytearray()
        self._is_closed = False

    def write(self, message: bytes, within_s: float) -> None:
        """Give the whole of `message` to the line.

        Raises LinkBusyError when the line does not take it in `within_s` seconds, and MtmError when the link failed.
        """
        deadline_s = time.monotonic() + within_s
        owed = len(self._unsent)
        self._unsent += message
        before = self.sent_bytes
        try:
            self._flush(deadline_s)
        except LinkBusyError as error:
            error.has_begun = self.sent_bytes - before > owed
            raise
        finally:
            if self.sent_bytes - before <= owed:
                del self._unsent[owed - (self.sent_bytes - before) :]

    def read(self) -> bytes:
        """What has arrived, without waiting; raises MtmError when the far end has closed the link or it failed."""
        data = bytearray()
        try:
            for _ in range(_READS_AT_ONCE):
                # A serial line reads as empty when nothing is there, a socket when its far end has gone. Both are
                # told apart by asking first: what is readable and yet empty has ended.
                if self._is_closed or not select.select([self._descriptor], (), (), 0)[0]:
                    break
                part = os.read(self._descriptor, _READ_BYTES)
                if not part and data:
                    break  # said next time, so that the robot's last words are heard
                if not part:
                    raise MtmError("The robot has closed the link; check its power and the cable.")
                data += part
        except BlockingIOError:
            pass
        except OSError as error:
            raise MtmError(f"The link cannot be read ({error}); check the robot's power and the cable.") from error
        self.received_bytes += len(data)
        return bytes(data)

    def close(self) -> None:
        """Release the descriptor; safe to call more than once."""
        if not self._is_closed:
            self._is_closed = True
            self._release()

    def _flush(self, deadline_s: float) -> None:
        if self._is_closed:
            raise MtmError("The link is closed; open it before sending.")
        while True:
            try:
                written = os.write(self._descriptor, self._unsent)
            except BlockingIOError:
                written = 0
            except OSError as error:
                raise MtmError(
                    f"The link refused a command ({error}); check the robot's power and the cable."
                ) from error
            self.sent_bytes += written
            del self._unsent[:written]
            if not self._unsent:
                return
            remaining_s = deadline_s - time.monotonic()
            if remaining_s <= 0 or not select.select((), [self._descriptor], (), remaining_s)[1]:
                raise LinkBusyError(
                    "The link took no command in time; check that the robot is on and that nothing blocks it."
                )


def serial_stream(port: str, baudrate: int) -> ByteStream:
    """Open a serial line, 8 data bits, no parity, 1 stop bit; raises MtmError when it cannot be had."""
    try:
        import serial
    except ImportError:
        raise MtmError(
            f"a serial line needs pyserial, which is not installed; install it with: {install_command('serial')}"
        ) from None
    try:
        # Exclusive: another program's commands on the same line would mix with ours.
        line = serial.Serial(port, baudrate, timeout=0, exclusive=True)
    except (OSError, ValueError) as error:
        raise MtmError(f"The serial line {port} cannot be opened ({error}); check the port and its owner.") from error
    return ByteStream(line.fileno(), line.close)


def tcp_stream(host: str, port: int) -> ByteStream:
    """Connect to `host`; raises MtmError when nobody answers there within a few seconds."""
    try:
        connection = socket.create_connection((host, port), _CONNECT_WITHIN_S)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
    except (OSError, OverflowError) as error:
        raise MtmError(
            f"The robot at {host} port {port} cannot be reached ({error}); check that it is on and in this network."
        ) from error
    return ByteStream(connection.fileno(), lambda: _close_delivered(connection))


def _close_delivered(connection: socket.socket) -> None:
    """Close when the far host has everything: closing while answers are unread would recall what is under way."""
    deadline_s = time.monotonic() + _DELIVER_WITHIN_S
    with suppress(OSError):
        while _unacknowledged_bytes(connection) and time.monotonic() < deadline_s:
            time.sleep(0.001)
    connection.close()


def _unacknowledged_bytes(connection: socket.socket) -> int:
    answer = fcntl.ioctl(connection, termios.TIOCOUTQ, bytes(4))
    return int(struct.unpack("i", answer)[0])
