"""A RoboMaster link over python-can's virtual bus, with the simulated robot at its far end."""

import itertools
from collections.abc import Iterator
from contextlib import contextmanager

import can

from hil.clock import SimulatedClock
from hil.robots.can_node import CanMotionController
from hil.robots.motion_controller import MotionController
from mtm_onboard.transports.robomaster_can import RoboMasterCan
from tests.hil.robots.floating_plant import FloatingPlant

_CHANNELS = (f"robomaster-{number}" for number in itertools.count())


class CanRig:
    def __init__(self, channel: str, deadman_s: float | None = None, poll_s: float = 0.010) -> None:
        self.clock = SimulatedClock()
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s)
        self.node = CanMotionController(self.controller, can.Bus(interface="virtual", channel=channel))
        self.tap = can.Bus(interface="virtual", channel=channel)
        self.transport = RoboMasterCan(interface="virtual", channel=channel)
        self.clock.every(poll_s, self.node.poll)
        self.clock.every(self.transport.service_period_s, self.transport.service)
        self.frames: list[can.Message] = []

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def sent(self) -> list[can.Message]:
        """Every frame that the transport has put on the bus so far."""
        while (frame := self.tap.recv(0)) is not None:
            if frame.arbitration_id == 0x201:
                self.frames.append(frame)
        return self.frames


@contextmanager
def can_rig(deadman_s: float | None = None, poll_s: float = 0.010) -> Iterator[CanRig]:
    rig = CanRig(next(_CHANNELS), deadman_s, poll_s)
    try:
        yield rig
    finally:
        rig.transport.close()
        rig.node.shutdown()
        rig.tap.shutdown()
