"""A RoboMaster link with the simulated robot at its far end, over python-can's virtual bus or a line in memory."""

import itertools
from collections.abc import Iterator
from contextlib import contextmanager

import can

from hil.clock import SimulatedClock
from hil.robots.can_line import LineEnd, can_line
from hil.robots.can_node import CanMotionController
from hil.robots.motion_controller import MotionController
from mtm_onboard.transports.robomaster_can import RoboMasterCan
from tests.hil.robots.floating_plant import FloatingPlant

_CHANNELS = (f"robomaster-{number}" for number in itertools.count())


class TappedEnd:
    """One end of a line that also keeps what is sent through it."""

    def __init__(self, end: LineEnd, tap: list[can.Message]) -> None:
        self._end = end
        self._tap = tap
        self.recv = end.recv
        self.shutdown = end.shutdown

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._tap.append(msg)
        self._end.send(msg, timeout)


class Rig:
    """What both kinds of bus have in common."""

    clock: SimulatedClock
    plant: FloatingPlant
    controller: MotionController
    node: CanMotionController
    transport: RoboMasterCan

    def assemble(self, node_bus: can.BusABC | LineEnd, deadman_s: float | None, poll_s: float) -> None:
        self.clock = SimulatedClock()
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s)
        self.node = CanMotionController(self.controller, node_bus)
        self.clock.every(poll_s, self.node.poll)
        self.clock.every(self.transport.service_period_s, self.transport.service)

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def sent(self) -> list[can.Message]:
        """Every frame that the transport has put on the bus so far."""
        raise NotImplementedError

    def shutdown(self) -> None:
        self.transport.close()
        self.node.shutdown()


class VirtualRig(Rig):
    def __init__(self, deadman_s: float | None = None, poll_s: float = 0.010) -> None:
        channel = next(_CHANNELS)
        self.tap = can.Bus(interface="virtual", channel=channel)
        self.transport = RoboMasterCan(interface="virtual", channel=channel)
        self._frames: list[can.Message] = []
        self.assemble(can.Bus(interface="virtual", channel=channel), deadman_s, poll_s)

    def sent(self) -> list[can.Message]:
        while (frame := self.tap.recv(0)) is not None:
            if frame.arbitration_id == 0x201:
                self._frames.append(frame)
        return self._frames

    def shutdown(self) -> None:
        super().shutdown()
        self.tap.shutdown()


class LineRig(Rig):
    def __init__(self, deadman_s: float | None = None, poll_s: float = 0.010) -> None:
        robots_end, our_end = can_line()
        self._frames: list[can.Message] = []
        self.transport = RoboMasterCan(TappedEnd(our_end, self._frames))
        self.assemble(robots_end, deadman_s, poll_s)

    def sent(self) -> list[can.Message]:
        return self._frames


@contextmanager
def can_rig(
    kind: type[VirtualRig | LineRig] = VirtualRig, deadman_s: float | None = None, poll_s: float = 0.010
) -> Iterator[VirtualRig | LineRig]:
    rig = kind(deadman_s, poll_s)
    try:
        yield rig
    finally:
        rig.shutdown()
