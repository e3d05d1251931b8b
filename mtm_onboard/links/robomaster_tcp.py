"""The RoboMaster EP's network: commands and answers over TCP, telemetry by UDP."""

import ipaddress
import socket

from mtm_onboard.links.byte_stream import ByteStream, tcp_stream
from mtm_onboard.links.plaintext_messages import CONTROL_PORT, PUSH_PORT
from mtm_onboard.links.robomaster_plaintext import RoboMasterPlaintext
from mtm_onboard.protocol.errors import MtmError

_DATAGRAMS_AT_ONCE = 32  # so that a babbling network cannot hold its reader for ever
_LONGEST_DATAGRAM = 2048


class RoboMasterTcp(RoboMasterPlaintext):
    """The robot at IP address `host`: 192.168.2.1 in its own Wi-Fi, 192.168.42.2 over USB.

    Telemetry comes to UDP port `push_port` of this host, where one program can listen at a time; datagrams of other
    hosts are not looked at. Raises MtmError when `host` is no such address.
    """

    def __init__(self, host: str, port: int = CONTROL_PORT, push_port: int = PUSH_PORT) -> None:
        super().__init__()
        try:
            # Datagrams are told from a stranger's by it, so a name would not do.
            self._host = str(ipaddress.IPv4Address(host))
        except ValueError:
            raise MtmError(f"the robot's host is {host!r}; give its IP address, such as 192.168.2.1") from None
        self._port = port
        self._push_port = push_port
        self._pushes: socket.socket | None = None

    def close(self) -> None:
        """Release the connection, which the robot takes for `quit`, and the port of the telemetry."""
        super().close()
        pushes, self._pushes = self._pushes, None
        if pushes is not None:
            pushes.close()

    def _connect(self) -> ByteStream:
        pushes = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            pushes.setblocking(False)
            pushes.bind(("", self._push_port))
            link = tcp_stream(self._host, self._port)
        except (OSError, OverflowError) as error:
            pushes.close()
            raise MtmError(
                f"The robot's telemetry cannot be received at UDP port {self._push_port} ({error}); end the program "
                "that listens there or choose another push_port."
            ) from error
        except MtmError:
            pushes.close()
            raise
        self._pushes = pushes
        return link

    def _datagrams(self) -> list[bytes]:
        datagrams: list[bytes] = []
        pushes = self._pushes
        if pushes is None:
            return datagrams
        try:
            for _ in range(_DATAGRAMS_AT_ONCE):
                data, (host, _) = pushes.recvfrom(_LONGEST_DATAGRAM)
                if host == self._host:
                    datagrams.append(data)
        except OSError:  # nothing more is there, or `close` has come in between
            pass
        return datagrams
