"""A MAVLink transport with the simulated vehicle at its far end, over a pipe and on one simulated clock."""

from dataclasses import dataclass

from hil.clock import SimulatedClock
from hil.robots.byte_pipe import PipeEnd, byte_pipe
from hil.robots.mavlink_firmware import COPTER, PX4, ROVER
from hil.robots.mavlink_vehicle import MavlinkVehicle
from mtm_onboard.motion import STOP
from mtm_onboard.transports.mavlink import MavlinkTransport
from tests.hil.robots.floating_plant import FloatingPlant
from tests.onboard.transports.conformance import Rig

FIRMWARES = {"rover": ROVER, "copter": COPTER, "px4": PX4}
FAKE_KEY = b"not a real secret, only for test"


class RecordedEnd:
    """A pipe's end that also keeps what is written, frame by frame."""

    def __init__(self, end: PipeEnd) -> None:
        self.frames: list[bytes] = []
        self.end = end
        self.read, self.keep_sender, self.close = end.read, end.keep_sender, end.close

    def write(self, data: bytes) -> None:
        self.end.write(data)
        self.frames.append(data)


@dataclass
class MavlinkRig(Rig):
    vehicle: MavlinkVehicle
    wire: RecordedEnd

    def is_engaged(self):
        return self.vehicle.is_obeying

    def is_released(self):
        """A copter that is disarmed falls, so that the link only has it stand."""
        return self.controller.demand == STOP

    def run(self, seconds):
        self.clock.sleep_until(self.clock.now() + seconds)


def mavlink_rig(profile="copter", *, vehicle=None, plant=None, **options) -> MavlinkRig:
    """`vehicle` goes to the simulated vehicle, other options to the transport; both are ready to drive by default."""
    clock = SimulatedClock()
    plant = plant or FloatingPlant()
    ours, theirs = byte_pipe()
    wire = RecordedEnd(ours)

    def timestamp():
        return 10**12 + int(1e5 * clock.now())

    ready = dict(is_guided=profile != "px4", is_armed=True, timestamp=timestamp)
    simulated = MavlinkVehicle(FIRMWARES[profile], plant, theirs, **(ready | (vehicle or {})))
    plain = dict(profile=profile, set_mode=profile == "px4", clock=clock, open_port=lambda: wire, timestamp=timestamp)
    transport = MavlinkTransport(**(plain | options))
    clock.every(0.010, simulated.poll)
    clock.every(transport.service_period_s, transport.service)
    return MavlinkRig(transport, simulated.controller, plant, clock, lambda: ours.sent, simulated, wire)
