"""A RoboMaster EP's plaintext link with the simulated robot at its far end: in memory, on a pty, or over TCP."""

import os
import select
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from hil.fleet.clock import SimulatedClock
from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import LinePort, Port, PtyPort, TcpPort
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.robomaster_plaintext import RoboMasterPlaintext
from mtm_onboard.links.robomaster_tcp import RoboMasterTcp
from mtm_onboard.links.robomaster_uart import RoboMasterUart
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.patience import PATIENCE_S


class OverSocket(RoboMasterPlaintext):
    """The link over a connected socket, which stays open for the next opening."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__()
        self._end = end

    def _connect(self) -> ByteStream:
        return ByteStream(self._end.fileno(), lambda: None)


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
        self.links: list[ByteStream] = []
        self.ends: list[socket.socket] = []
        self.is_cut = False
        self._refusals = 0
        self._made: list[RoboMasterPlaintext] = []
        self._make, port = self._line(kind)
        self.port = CountingPort(port, self)
        self.node = PlaintextMotionController(self.controller, [*others, self.port])
        self.transport = self.remake()
        self.clock.every(0.010, self.node.poll)
        self.clock.every(self.transport.service_period_s, self.transport.service)

    def remake(self) -> RoboMasterPlaintext:
        """Another transport to the same robot."""
        transport = self._make()
        connect, serve = transport._connect, transport.service
        transport._connect = lambda: self._counted_link(connect)
        transport.service = lambda now_s: self._served(transport, serve, now_s)
        self._made.append(transport)
        return transport

    def sent_bytes(self) -> int:
        return sum(link.sent_bytes for link in self.links)

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def drive(self, velocity: BodyVelocity, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.transport.send(velocity)
            self.run(0.02)

    def refuse(self, writes: int) -> None:
        self._refusals = writes

    def clog(self) -> None:
        """Leave no room in the line, from which nobody reads until the clock goes on."""
        descriptor, deadline_s = self.links[-1]._descriptor, time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline_s:
            try:
                os.write(descriptor, b" " * 64)
            except BlockingIOError:
                if not select.select([], [descriptor], [], 0.05)[1]:
                    return
        raise AssertionError("the line never filled")

    def cut(self) -> None:
        self.is_cut = True

    def mend(self) -> None:
        self.is_cut = False

    def shutdown(self) -> None:
        for transport in self._made:
            transport.close()
        self.node.shutdown()
        for end in self.ends:
            end.close()

    def _line(self, kind: str) -> tuple[Callable[[], RoboMasterPlaintext], Port]:
        if kind == "pty":
            port = PtyPort()
            return lambda: RoboMasterUart(port.path), port
        if kind == "tcp":
            push_port = free_udp_port()
            tcp_port = TcpPort(push_port=push_port)
            # Or it would take megabytes before it were full.
            tcp_port._listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            return lambda: RoboMasterTcp("127.0.0.1", tcp_port.port, push_port), tcp_port
        ours, theirs = socket.socketpair()
        self.ends = [ours, theirs]
        return lambda: OverSocket(ours), LinePort(theirs.fileno(), lambda: None)

    def _counted_link(self, connect: Callable[[], ByteStream]) -> ByteStream:
        self._check_wire()
        link = connect()
        write, read = link.write, link.read
        link.write = lambda message, within_s: self._check_wire() or write(message, within_s)
        link.read = lambda: b"" if self.is_cut else read()
        self.links.append(link)
        # What was answered before is lost or read in addition.
        self._answered = self.port.answered
        return link

    def _check_wire(self) -> None:
        if self.is_cut or self._refusals:
            self._refusals = max(0, self._refusals - 1)
            raise MtmError("The wire is broken, for a test; mend it.")

    def _served(self, transport: RoboMasterPlaintext, serve: Callable[[float], None], now_s: float) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while True:
            serve(now_s)
            if transport._link is None or self.is_cut:
                return
            if transport._link.received_bytes >= self.port.answered - self._answered:
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
