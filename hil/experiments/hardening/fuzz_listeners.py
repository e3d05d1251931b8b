"""Both ends of every wire, telling of each message that passed whatever check its format has."""

from collections.abc import Callable
from typing import Any

from hil.experiments.hardening.fuzz_traffic import signing_time
from hil.fleet.clock import AnsweringClock, SimulatedClock
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.mavlink_firmware import COPTER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.byte_pipe import PipeEnd
from hil.wires.can_line import LineEnd
from hil.wires.plaintext_line import LineLink
from hil.wires.plaintext_ports import Port
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.can_stream import CanStream
from mtm_onboard.links.duml import Message, encode
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.mavlink_profiles import PROFILES, Profile
from mtm_onboard.links.mavlink_state import VehicleState
from mtm_onboard.links.robomaster_can import RoboMasterCan

# Takes a message as the bytes that it came in.
Hears = Callable[[bytes], None]


class FedPort(Port):
    """A line on which `waiting` arrives; nobody listens at its other end."""

    def __init__(self) -> None:
        self.waiting = bytearray()

    def receive(self) -> bytes | None:
        """What waits."""
        data = bytes(self.waiting)
        self.waiting.clear()
        return data

    def answer(self, text: bytes) -> None:
        """Nobody listens."""

    push = answer

    def shutdown(self) -> None:
        """There is nothing to release."""


class HearingNode(CanMotionController):
    """The robot on the CAN bus; `stream` is its end of it."""

    def __init__(self, controller: MotionController, bus: LineEnd, hears: Hears) -> None:
        super().__init__(controller, bus)
        self._hears = hears

    @property
    def stream(self) -> CanStream:
        """Its end of the bus."""
        return self._wire

    def _obey(self, message: Message, now_s: float) -> None:
        self._hears(encode(message))
        super()._obey(message, now_s)


class HearingCan(RoboMasterCan):
    """The link on the CAN bus, which is opened with a willing robot at `far_end`."""

    def __init__(self, bus: LineEnd, far_end: LineEnd, hears: Hears) -> None:
        robot = CanMotionController(idle_controller(), far_end)
        super().__init__(bus, clock=AnsweringClock(SimulatedClock(), robot.poll))
        self._hears: Hears = lambda _: None
        self.open()
        self._hears = hears

    @property
    def failed_checks(self) -> int:
        """Checksums of whole messages that were found wrong."""
        return 0 if self._stream is None else self._stream.parser.checksum_failures

    def _take(self, message: Message, now_s: float) -> None:
        self._hears(encode(message))
        super()._take(message, now_s)


class HearingServer(PlaintextMotionController):
    """The plaintext robot, which tells of what it obeys."""

    def __init__(self, controller: MotionController, port: Port, hears: Hears) -> None:
        super().__init__(controller, [port])
        self._hears = hears

    def _obey(self, port: Port, text: str, now_s: float) -> None:
        before = self.obeyed
        super()._obey(port, text, now_s)
        if self.obeyed > before:
            self._hears(as_text(text) + b";")


class HearingPlaintext(LineLink):
    """The plaintext transport, which tells of what it does not call malformed."""

    def __init__(self, link: ByteStream, hears: Hears) -> None:
        super().__init__(link)
        self._hears = hears

    def _take(self, text: str, now_s: float) -> None:
        before = self.malformed
        super()._take(text, now_s)
        if self.malformed == before and text.strip(" "):
            self._hears(as_text(text) + b";")


class HearingVehicle(MavlinkVehicle):
    """The autopilot."""

    def __init__(self, port: PipeEnd, key: bytes | None, hears: Hears) -> None:
        plant = MecanumPlant(calibrated_parameters(), 0)
        super().__init__(COPTER, plant, port, is_guided=True, is_armed=True, signing_key=key, timestamp=signing_time)
        self._hears = hears

    def _take(self, message: Any, now_s: float) -> None:
        self._hears(bytes(message.get_msgbuf()))
        super()._take(message, now_s)


class HearingMavlink(MavlinkLink):
    """The MAVLink transport."""

    def __init__(self, port: PipeEnd, clock: SimulatedClock, hears: Hears) -> None:
        super().__init__(profile="copter", clock=clock, open_port=lambda: port)
        self._vehicle = _HearingState(PROFILES["copter"], hears)


class _HearingState(VehicleState):
    def __init__(self, profile: Profile, hears: Hears) -> None:
        super().__init__(profile, 1)
        self._hears = hears

    def take(self, message: Any, now_s: float) -> bool:
        """Tell of it, then read it."""
        self._hears(bytes(message.get_msgbuf()))
        return super().take(message, now_s)


def as_text(text: str) -> bytes:
    """What was read as text, with a question mark for each byte that is none."""
    return text.encode("ascii", "replace")


def idle_controller() -> MotionController:
    """A motion controller without a deadman over a chassis of its own."""
    return MotionController(MecanumPlant(calibrated_parameters(), 0), deadman_s=None)
