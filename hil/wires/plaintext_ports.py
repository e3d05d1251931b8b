"""The lines on which a simulated RoboMaster EP meets its client: one like a UART, and TCP with UDP beside it.

Nothing here ever waits. What a client is too slow to read is lost, whole texts at a time.
"""

import os
import socket
import tty
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from mtm_onboard.links.plaintext_messages import PUSH_PORT

_READ_BYTES = 65_536
_MOST_UNSENT_BYTES = 16_384
_MOST_EVENT_CLIENTS = 8


class Port(Protocol):
    """What the robot needs of a line."""

    def receive(self) -> bytes | None:
        """What has arrived; None once when the client has gone."""
        ...

    def answer(self, text: bytes) -> None:
        """Answer a command."""
        ...

    def push(self, text: bytes) -> None:
        """Send telemetry."""
        ...

    def shutdown(self) -> None:
        """Release the line; safe to call more than once."""
        ...


class LinePort:
    """A line that carries everything, as a UART does; `descriptor` is the robot's end, and `release` closes it."""

    def __init__(self, descriptor: int, release: Callable[[], None] | None = None) -> None:
        os.set_blocking(descriptor, False)
        self.lost_texts = 0
        self._descriptor = descriptor
        self._release = release or (lambda: os.close(descriptor))
        self._unsent = bytearray()
        self._is_shut_down = False

    def receive(self) -> bytes | None:
        """What has arrived; None when the client has gone, which a UART never knows."""
        if self._is_shut_down:
            return None
        self._flush()
        try:
            return os.read(self._descriptor, _READ_BYTES) or None
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def answer(self, text: bytes) -> None:
        """Send `text`, or lose it when the client does not read."""
        if len(self._unsent) + len(text) > _MOST_UNSENT_BYTES:
            self.lost_texts += 1
        else:
            self._unsent += text
        self._flush()

    push = answer

    def shutdown(self) -> None:
        """Close the line."""
        if not self._is_shut_down:
            self._is_shut_down = True
            self._release()

    def _flush(self) -> None:
        if self._unsent and not self._is_shut_down:
            try:
                del self._unsent[: os.write(self._descriptor, self._unsent)]
            except BlockingIOError:
                pass
            except OSError:  # the client has gone, as the next `receive` tells
                self._unsent.clear()


class PtyPort(LinePort):
    """A UART that is a pseudo-terminal; a program in another process opens `path` as a serial line."""

    def __init__(self) -> None:
        ours, theirs = os.openpty()
        # Their end stays open here too, so that the line outlives the program at the other end.
        tty.setraw(theirs)
        self.path = os.ttyname(theirs)

        def release() -> None:
            os.close(ours)
            os.close(theirs)

        super().__init__(ours, release)


class TcpPort:
    """The network: commands and answers over TCP at `host` and `port`, telemetry by UDP to the client's `push_port`.

    One client is served at a time, and the next when it has gone. Port 0 takes a free one, which `port` then tells.
    With an `event_port` whoever connects there is let in and told nothing, as by a robot that meets no event; clients
    are known that do not begin without.
    """

    def __init__(
        self, host: str = "127.0.0.1", port: int = 0, push_port: int = PUSH_PORT, event_port: int | None = None
    ) -> None:
        self._listener = socket.create_server((host, port))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._push_port = push_port
        # From the same address, so that the client knows whose telemetry it is.
        self._pushes = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._pushes.bind((host, 0))
        self._pushes.setblocking(False)
        self._client: LinePort | None = None
        self._client_host = ""
        self._events = None if event_port is None else socket.create_server((host, event_port))
        self._event_clients: deque[socket.socket] = deque()
        self.event_port = 0
        if self._events is not None:
            self._events.setblocking(False)
            self.event_port = self._events.getsockname()[1]

    def receive(self) -> bytes | None:
        """What has arrived; None once when the client has gone."""
        self._accept_event_client()
        if self._client is None:
            self._client = self._accepted()
        if self._client is None:
            return b""
        data = self._client.receive()
        if data is None:
            self._client.shutdown()
            self._client = None
        return data

    def answer(self, text: bytes) -> None:
        """Answer the client that is there."""
        if self._client is not None:
            self._client.answer(text)

    def push(self, text: bytes) -> None:
        """Send one datagram to the client's host."""
        with suppress(OSError):  # nobody listens there, or the network is full: datagrams may be lost
            self._pushes.sendto(text, (self._client_host, self._push_port))

    def shutdown(self) -> None:
        """Stop listening and drop the client."""
        if self._client is not None:
            self._client.shutdown()
        self._listener.close()
        self._pushes.close()
        for connection in (self._events, *self._event_clients):
            if connection is not None:
                connection.close()

    def _accept_event_client(self) -> None:
        if self._events is None:
            return
        with suppress(OSError):  # nobody has come
            self._event_clients.append(self._events.accept()[0])
            while len(self._event_clients) > _MOST_EVENT_CLIENTS:
                self._event_clients.popleft().close()

    def _accepted(self) -> LinePort | None:
        try:
            connection, (self._client_host, _) = self._listener.accept()
        except OSError:
            return None
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return LinePort(connection.fileno(), connection.close)
