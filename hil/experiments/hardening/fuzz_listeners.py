"""Both ends of every wire, which report each message that passed the checks of its format."""

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

# Called with the bytes of an accepted message.
OnMessage = Callable[[bytes], None]


class FedPort(Port):
    """A line on which `waiting` arrives and whose other end discards everything."""

    def __init__(self) -> None:
        self.waiting = bytearray()

    def receive(self) -> bytes | None:
        """The bytes that wait."""
        data = bytes(self.waiting)
        self.waiting.clear()
        return data

    def answer(self, text: bytes) -> None:
        """Discard it."""

    push = answer

    def shutdown(self) -> None:
        """There is nothing to release."""


class CanNodeListener(CanMotionController):
    """The robot on the CAN bus; `stream` is its end of it."""

    def __init__(self, controller: MotionController, bus: LineEnd, on_message: OnMessage) -> None:
        super().__init__(controller, bus)
        self._on_message = on_message

    @property
    def stream(self) -> CanStream:
        """Its end of the bus."""
        return self._wire

    def _obey(self, message: Message, now_s: float) -> None:
        self._on_message(encode(message))
        super()._obey(message, now_s)


class CanLinkListener(RoboMasterCan):
    """The link on the CAN bus, opened with a robot that answers at `far_end`; reports what comes after that."""

    def __init__(self, bus: LineEnd, far_end: LineEnd, on_message: OnMessage) -> None:
        robot = CanMotionController(idle_controller(), far_end)
        super().__init__(bus, clock=AnsweringClock(SimulatedClock(), robot.poll))
        self._on_message: OnMessage = lambda _: None
        self.open()
        self._on_message = on_message

    @property
    def failed_checks(self) -> int:
        """Checksums of whole messages that were found wrong."""
        return 0 if self._stream is None else self._stream.parser.checksum_failures

    def _take(self, message: Message, now_s: float) -> None:
        self._on_message(encode(message))
        super()._take(message, now_s)


class PlaintextNodeListener(PlaintextMotionController):
    """The robot on the plaintext line; reports the commands that it obeys."""

    def __init__(self, controller: MotionController, port: Port, on_message: OnMessage) -> None:
        super().__init__(controller, [port])
        self._on_message = on_message

    def _obey(self, port: Port, text: str, now_s: float) -> None:
        before = self.obeyed
        super()._obey(port, text, now_s)
        if self.obeyed > before:
            self._on_message(as_text(text) + b";")


class PlaintextLinkListener(LineLink):
    """Our end of the plaintext line; reports the texts that are not malformed."""

    def __init__(self, link: ByteStream, on_message: OnMessage) -> None:
        super().__init__(link)
        self._on_message = on_message

    def _take(self, text: str, now_s: float) -> None:
        before = self.malformed
        super()._take(text, now_s)
        if self.malformed == before and text.strip(" "):
            self._on_message(as_text(text) + b";")


class VehicleListener(MavlinkVehicle):
    """The autopilot."""

    def __init__(self, port: PipeEnd, key: bytes | None, on_message: OnMessage) -> None:
        plant = MecanumPlant(calibrated_parameters(), 0)
        super().__init__(COPTER, plant, port, is_guided=True, is_armed=True, signing_key=key, timestamp=signing_time)
        self._on_message = on_message

    def _take(self, message: Any, now_s: float) -> None:
        self._on_message(bytes(message.get_msgbuf()))
        super()._take(message, now_s)


class MavlinkLinkListener(MavlinkLink):
    """The MAVLink link."""

    def __init__(self, port: PipeEnd, clock: SimulatedClock, on_message: OnMessage) -> None:
        super().__init__(profile="copter", clock=clock, open_port=lambda: port)
        self._vehicle = _VehicleStateListener(PROFILES["copter"], on_message)


class _VehicleStateListener(VehicleState):
    def __init__(self, profile: Profile, on_message: OnMessage) -> None:
        super().__init__(profile, 1)
        self._on_message = on_message

    def take(self, message: Any, now_s: float) -> bool:
        """Report the message, then take it."""
        self._on_message(bytes(message.get_msgbuf()))
        return super().take(message, now_s)


def as_text(text: str) -> bytes:
    """The text as ASCII, with a question mark for every other character."""
    return text.encode("ascii", "replace")


def idle_controller() -> MotionController:
    """A motion controller without a deadman over a chassis of its own."""
    return MotionController(MecanumPlant(calibrated_parameters(), 0), deadman_s=None)
