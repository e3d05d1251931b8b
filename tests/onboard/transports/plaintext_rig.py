"""A RoboMaster EP's plaintext link with the simulated robot at its far end: in memory, on a pty, or over TCP."""

import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from hil.clock import SimulatedClock
from hil.robots.motion_controller import MotionController
from hil.robots.plaintext_node import PlaintextMotionController
from hil.robots.plaintext_ports import LinePort, Port, PtyPort, TcpPort
from mtm_onboard.motion import BodyVelocity
from mtm_onboard.transports.byte_link import ByteLink
from mtm_onboard.transports.robomaster_plaintext import RoboMasterPlaintext
from mtm_onboard.transports.robomaster_tcp import RoboMasterTcp
from mtm_onboard.transports.robomaster_uart import RoboMasterUart
from tests.hil.robots.floating_plant import FloatingPlant

# The kernel passes bytes along in its own time, which the simulated clock waits for, briefly.
PATIENCE_S = 5.0


class OverSocket(RoboMasterPlaintext):
    """The link over a connected socket, which stays open for the next opening."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__()
        self._end = end

    def _connect(self) -> ByteLink:
        return ByteLink(self._end.fileno(), lambda: None)


class CountingPort:
    """A port that receives only when all that was `sent()` has come, and counts what it answers."""

    def __init__(self, port: Port, rig: "PlaintextRig") -> None:
        self._port = port
        self._rig = rig
        self.received = 0
        self.answered = 0
        self.shutdown = port.shutdown

    def receive(self) -> bytes | None:
        data, deadline_s = b"", time.monotonic() + PATIENCE_S
        while True:
            part = self._port.receive()
            self.received += len(part or b"")
            data += part or b""
            if self.received >= self._rig.sent_bytes():
                return data or part
            assert time.monotonic() < deadline_s

    def answer(self, text: bytes) -> None:
        self.answered += len(text)
        self._port.answer(text)

    def push(self, text: bytes) -> None:
        if not isinstance(self._port, TcpPort):
            self.answered += len(text)
        self._port.push(text)


class PlaintextRig:
    """`kind` is "memory", "pty" or "tcp"; in simulated time whatever the line. `others` are further ports."""

    def __init__(self, kind: str, others: Sequence[Port] = ()) -> None:
        self.clock = SimulatedClock()
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s=None)
        self.links: list[ByteLink] = []
        self.ends: list[socket.socket] = []
        self.transport, port = self._line(kind)
        self.port = CountingPort(port, self)
        self.node = PlaintextMotionController(self.controller, [*others, self.port])
        self._connect = self.transport._connect
        self.transport._connect = self._counted_link
        self.clock.every(0.010, self.node.poll)
        self.clock.every(self.transport.service_period_s, self._service)

    def sent_bytes(self) -> int:
        return sum(link.sent_bytes for link in self.links)

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def drive(self, velocity: BodyVelocity, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.transport.send(velocity)
            self.run(0.02)

    def shutdown(self) -> None:
        self.transport.close()
        self.node.shutdown()
        for end in self.ends:
            end.close()

    def _line(self, kind: str) -> tuple[RoboMasterPlaintext, Port]:
        if kind == "pty":
            port = PtyPort()
            return RoboMasterUart(port.path), port
        if kind == "tcp":
            push_port = free_udp_port()
            tcp_port = TcpPort(push_port=push_port)
            return RoboMasterTcp("127.0.0.1", tcp_port.port, push_port), tcp_port
        ours, theirs = socket.socketpair()
        self.ends = [ours, theirs]
        return OverSocket(ours), LinePort(theirs.fileno(), lambda: None)

    def _counted_link(self) -> ByteLink:
        self.links.append(self._connect())
        # What was answered before is lost or read in addition.
        self._answered = self.port.answered
        return self.links[-1]

    def _service(self, now_s: float) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while True:
            self.transport.service(now_s)
            if self.transport._link is None or self.links[-1].received_bytes >= self.port.answered - self._answered:
                return
            assert time.monotonic() < deadline_s


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


@contextmanager
def plaintext_rig(kind: str = "memory", others: Sequence[Port] = ()) -> Iterator[PlaintextRig]:
    rig = PlaintextRig(kind, others)
    try:
        yield rig
    finally:
        rig.shutdown()
