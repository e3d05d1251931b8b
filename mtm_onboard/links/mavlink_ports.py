"""The byte ports under a MAVLink link: serial line, UDP and TCP, named as pymavlink names them.

pymavlink's own connections print and swallow errors, reconnect in the middle of a write, and a listening one sends to
everybody it ever heard of. A robot needs errors that arrive, writes that never wait long, and one vehicle.
"""

import socket
from collections.abc import Callable
from typing import Protocol

from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.byte_stream import ByteStream, serial_stream, tcp_stream
from mtm_onboard.protocol.errors import MtmError

_MOST_BYTES = 4096


class Port(Protocol):
    """What a link needs of its wire; all of it but `close` raises MtmError when the wire is broken."""

    def write(self, frame: bytes) -> None:
        """Send one frame, whole and without waiting longer than the port may."""
        ...

    def read(self) -> bytes:
        """What has arrived, at most one datagram; empty when there is nothing. Never waits."""
        ...

    def keep_sender(self) -> None:
        """Talk to whoever sent what was read last, and to nobody else from now on."""
        ...

    def close(self) -> None:
        """Release the wire; safe to call more than once."""
        ...


class StreamPort:
    """A serial line or a TCP connection, which has one other end."""

    def __init__(self, link: ByteStream, write_bound_s: float) -> None:
        self._link = link
        self._write_bound_s = write_bound_s

    def write(self, frame: bytes) -> None:
        """Send one frame; raises MtmError when the line has not taken it within the bound."""
        self._link.write(frame, self._write_bound_s)

    def read(self) -> bytes:
        """What has arrived; raises MtmError when the other end is gone."""
        return self._link.read()

    def keep_sender(self) -> None:
        """There is no other sender."""

    def close(self) -> None:
        """Close the line."""
        self._link.close()


class UdpPort:
    """Datagrams to and from one peer: the one at `peer`, or, listening, the one that `keep_sender` settles on.

    A listening port that knows no peer yet has nobody to write to, and drops what is written. Raises MtmError when
    the addresses cannot be had.
    """

    def __init__(self, listen: tuple[str, int] | None = None, peer: tuple[str, int] | None = None) -> None:
        self._sender: tuple[str, int] | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._peer = None if peer is None else (socket.gethostbyname(peer[0]), peer[1])
            self._socket.bind(("0.0.0.0", 0) if listen is None else listen)
        except OSError as error:
            self._socket.close()
            raise MtmError(
                f"The UDP address {listen or peer} cannot be used ({error}); check host and port."
            ) from error

    @property
    def number(self) -> int:
        """The port number at which this end receives."""
        number: int = self._socket.getsockname()[1]
        return number

    def write(self, frame: bytes) -> None:
        """Send one datagram."""
        if self._peer is None:
            return
        try:
            self._socket.sendto(frame, self._peer)
        except BlockingIOError as error:
            raise LinkBusyError("The network takes no message right now; check the way to the vehicle.") from error
        except OSError as error:
            raise MtmError(f"The network refused a message ({error}); check the way to the vehicle.") from error

    def read(self) -> bytes:
        """The next datagram of the peer, or of anybody while there is none."""
        try:
            while True:
                data, sender = self._socket.recvfrom(_MOST_BYTES)
                if self._peer in (None, sender):
                    self._sender = sender
                    return data
        except BlockingIOError:
            return b""
        except OSError as error:
            raise MtmError(f"The network cannot be read ({error}); check the way to the vehicle.") from error

    def keep_sender(self) -> None:
        """Settle on the sender of the datagram that was read last."""
        if self._peer is None:
            self._peer = self._sender

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def port_opener(endpoint: str, baud: int, write_bound_s: float) -> Callable[[], Port]:
    """What opens `endpoint`: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, or a serial device's path.

    Raises MtmError for an endpoint that is none of these, as opening does for one that cannot be had.
    """
    kind, colon, rest = endpoint.partition(":")
    if endpoint and not colon:
        return lambda: StreamPort(serial_stream(endpoint, baud), write_bound_s)
    host, _, number = rest.rpartition(":")
    if kind not in ("udpin", "udpout", "tcp") or not host or not (number.isdecimal() and 0 < int(number) < 65_536):
        raise MtmError(
            f"the MAVLink endpoint is {endpoint!r}; give udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or the path "
            "of a serial device"
        )
    address = host, int(number)
    if kind == "tcp":
        return lambda: StreamPort(tcp_stream(*address), write_bound_s)
    if kind == "udpin":
        return lambda: UdpPort(listen=address)
    return lambda: UdpPort(peer=address)
