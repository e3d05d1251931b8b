"""A MAVLink transport with the simulated vehicle at its far end, over a pipe and on one simulated clock."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from hil.fleet.clock import SimulatedClock
from hil.vehicles.mavlink_firmware import COPTER, PX4, ROVER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.wires.byte_pipe import byte_pipe
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.mavlink_ports import Port, StreamPort
from mtm_onboard.model.velocity import STOP
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.conformance import Rig

FIRMWARES = {"rover": ROVER, "copter": COPTER, "px4": PX4}
FAKE_KEY = b"not a real secret, only for test"


class RecordedPort:
    """A port that also keeps what is written, frame by frame; it refuses the next `refusing` writes."""

    def __init__(self, port: Port) -> None:
        self.frames: list[bytes] = []
        self.refusing = 0
        self.port = port
        self.read, self.keep_sender, self.close = port.read, port.keep_sender, port.close

    def write(self, frame: bytes) -> None:
        if self.refusing > 0:
            self.refusing -= 1
            raise MtmError("the wire refused a frame")
        self.port.write(frame)
        self.frames.append(frame)


@dataclass
class MavlinkRig(Rig):
    vehicle: MavlinkVehicle
    wire: RecordedPort

    def is_engaged(self):
        return self.vehicle.is_obeying

    def is_released(self):
        """A copter that is disarmed falls, so that the link only has it stand."""
        return self.controller.demand == STOP

    def run(self, seconds):
        self.clock.sleep_until(self.clock.now() + seconds)


def mavlink_rig(profile="copter", *, ports=None, vehicle=None, **options) -> MavlinkRig:
    """`vehicle` goes to the simulated vehicle, other options to the transport; both are ready to drive by default.

    `ports` are both ends of the wire, a pipe by default.
    """
    clock, plant = SimulatedClock(), FloatingPlant()
    ours, theirs = ports or byte_pipe()
    wire = RecordedPort(ours)

    def timestamp():
        return 10**12 + int(1e5 * clock.now())

    ready = dict(is_guided=profile != "px4", is_armed=True, timestamp=timestamp)
    simulated = MavlinkVehicle(FIRMWARES[profile], plant, theirs, **(ready | (vehicle or {})))
    plain = dict(profile=profile, set_mode=profile == "px4", clock=clock, open_port=lambda: wire, timestamp=timestamp)
    transport = MavlinkLink(**(plain | options))
    clock.every(0.010, simulated.poll)
    clock.every(transport.service_period_s, transport.service)
    return MavlinkRig(
        transport, simulated.controller, plant, clock, lambda: sum(map(len, wire.frames)), simulated, wire,
        refuse=lambda writes: setattr(wire, "refusing", writes),
    )  # fmt: skip


@contextmanager
def line_rig(profile="copter", **options) -> Iterator[MavlinkRig]:
    """The same over a stream of the kernel's, which can be clogged."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ports = [StreamPort(ByteStream(end.fileno(), lambda: None), 0.0025) for end in (ours, theirs)]
        rig = mavlink_rig(profile, ports=ports, **options)

        def clog():
            with suppress(BlockingIOError):
                while True:
                    ours.send(bytes(4096))

        rig.clog = clog
        yield rig
