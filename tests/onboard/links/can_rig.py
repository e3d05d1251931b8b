"""A RoboMaster link with the simulated robot at its far end, over python-can's virtual bus or a line in memory."""

import itertools
import time
from collections.abc import Iterator
from contextlib import contextmanager

import can

from hil.fleet.clock import SimulatedClock
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.can_line import LineEnd, can_line
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant

_CHANNELS = (f"robomaster-{number}" for number in itertools.count())


class Wiring:
    """What is wrong with the wire: how many frames it still refuses, whether it is cut, or clogged."""

    def __init__(self) -> None:
        self.refusing = 0
        self.is_cut = False
        self.is_clogged = False

    def carry(self, timeout: float | None) -> None:
        if self.refusing:
            self.refusing -= 1
            raise can.CanOperationError("frame refused")
        if self.is_cut:
            raise can.CanOperationError("bus off")
        if self.is_clogged:
            time.sleep(timeout or 0.0)
            raise can.CanOperationError("transmit buffer full")


class WiredBus:
    """A bus behind a `Wiring`, which also keeps what is sent."""

    def __init__(self, bus: can.BusABC | LineEnd, wiring: Wiring, tap: list[can.Message]) -> None:
        self._bus = bus
        self._wiring = wiring
        self._tap = tap

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._wiring.carry(timeout)
        self._tap.append(msg)
        self._bus.send(msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self._wiring.is_cut:
            raise can.CanOperationError("bus off")
        return self._bus.recv(timeout)

    def shutdown(self) -> None:
        # The line in memory has one end for all who come after one another.
        if not isinstance(self._bus, LineEnd):
            self._bus.shutdown()


class Rig:
    """What both kinds of bus have in common."""

    clock: SimulatedClock
    plant: FloatingPlant
    controller: MotionController
    node: CanMotionController
    transport: RoboMasterCan
    wiring: Wiring

    def assemble(self, node_bus: can.BusABC | LineEnd, deadman_s: float | None, poll_s: float) -> None:
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s)
        self.node = CanMotionController(self.controller, node_bus)
        self.clock.every(poll_s, self.node.poll)
        self.clock.every(self.transport.service_period_s, self.transport.service)

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def remake(self) -> RoboMasterCan:
        """Another transport to the same robot; raises MtmError while the wire is cut."""
        if self.wiring.is_cut:
            raise MtmError("no adapter there")
        return RoboMasterCan(WiredBus(self.bus(), self.wiring, []), clock=self.clock)

    def bus(self) -> can.BusABC | LineEnd:
        """Our end of the wire."""
        raise NotImplementedError

    def cut(self) -> None:
        self.wiring.is_cut = True

    def mend(self) -> None:
        self.wiring.is_cut = False

    def clog(self) -> None:
        self.wiring.is_clogged = True

    def refuse(self, frames: int) -> None:
        self.wiring.refusing = frames

    def sent(self) -> list[can.Message]:
        """Every frame that the transport has put on the bus so far."""
        raise NotImplementedError

    def shutdown(self) -> None:
        self.transport.close()
        self.node.shutdown()


class VirtualRig(Rig):
    def __init__(self, deadman_s: float | None = None, poll_s: float = 0.010) -> None:
        self._channel = channel = next(_CHANNELS)
        self.wiring = Wiring()
        self.tap = can.Bus(interface="virtual", channel=channel)
        self.clock = SimulatedClock()
        self.transport = RoboMasterCan(interface="virtual", channel=channel, clock=self.clock)
        opened = self.transport._opened_bus
        self.transport._opened_bus = lambda: WiredBus(opened(), self.wiring, [])
        self._frames: list[can.Message] = []
        self.assemble(can.Bus(interface="virtual", channel=channel), deadman_s, poll_s)

    def bus(self) -> can.BusABC:
        return can.Bus(interface="virtual", channel=self._channel)

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
        robots_end, self._our_end = can_line()
        self.wiring = Wiring()
        self._frames: list[can.Message] = []
        self.clock = SimulatedClock()
        self.transport = RoboMasterCan(WiredBus(self._our_end, self.wiring, self._frames), clock=self.clock)
        self.assemble(robots_end, deadman_s, poll_s)

    def bus(self) -> LineEnd:
        return self._our_end

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
