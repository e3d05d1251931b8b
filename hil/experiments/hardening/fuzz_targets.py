"""What is fuzzed: each end of each wire, fed with bytes as they come from its other end."""

import random
import socket
from abc import ABC, abstractmethod
from collections.abc import Callable

import can

from hil.experiments.hardening.fuzz_listeners import (
    CanLinkListener,
    CanNodeListener,
    FedPort,
    MavlinkLinkListener,
    PlaintextLinkListener,
    PlaintextNodeListener,
    VehicleListener,
    as_text,
    idle_controller,
)
from hil.experiments.hardening.fuzz_traffic import (
    COMMANDS,
    FAKE_KEY,
    can_from_robot,
    can_to_robot,
    mavlink_from_vehicle,
    mavlink_to_vehicle,
    plaintext_from_robot,
    plaintext_to_robot,
    signing_time,
)
from hil.experiments.hardening.mutations import Traffic
from hil.fleet.clock import SimulatedClock
from hil.wires.byte_pipe import PipeEnd, byte_pipe
from hil.wires.can_line import LineEnd, can_line
from hil.wires.plaintext_ports import LinePort
from mtm_onboard.links.base import Link
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.duml import MAX_LENGTH
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import COMPANION_COMPONENT, companion_heartbeat
from mtm_onboard.links.robomaster_messages import FROM_COMPANION_ID, FROM_MOTION_CONTROLLER_ID
from mtm_onboard.protocol import MtmError

STEP_S = 0.01

_LATER = 100_000  # a second, in the signature's unit


class Target(ABC):
    """One end of a wire.

    `stream` is all bytes that arrived, `accepted` the messages accepted from them, `made` the messages that senders
    made, and `filler` the bytes that complete whatever message has begun.
    """

    filler: bytes

    def __init__(self, traffic: Traffic) -> None:
        self.traffic = traffic
        self.made = {piece for message in traffic.messages for piece in self._pieces(message)}
        self.stream = bytearray()
        self.accepted: list[bytes] = []
        self._now_s = 0.0

    def feed(self, draw: random.Random, data: bytes) -> None:
        """Let `data` arrive, then run one period."""
        self._now_s += STEP_S
        self.stream += self._as_read(data)
        self._arrive(draw, data)
        self._serve(self._now_s)

    @property
    def failed_checks(self) -> int:
        """Checksums that were found wrong; 0 for a format without."""
        return 0

    def probe_message(self) -> bytes:
        """A valid message that this end must accept whatever came before it."""
        return self.traffic.messages[0]

    def _as_read(self, data: bytes) -> bytes:
        return data

    def _pieces(self, message: bytes) -> list[bytes]:
        """The messages that this end accepts separately."""
        return [message]

    @abstractmethod
    def _arrive(self, draw: random.Random, data: bytes) -> None:
        """Put `data` on the wire."""

    @abstractmethod
    def _serve(self, now_s: float) -> None:
        """Let this end read it, and discard what it answers."""

    def shutdown(self) -> None:  # noqa: B027 - most hold nothing
        """Release what the target holds."""


class _Can(Target):
    filler = bytes(MAX_LENGTH + 1)
    _send_id: int

    def __init__(self, traffic: Traffic, feeder: LineEnd) -> None:
        super().__init__(traffic)
        self._feeder = feeder

    def _arrive(self, draw: random.Random, data: bytes) -> None:
        while data:
            length = 8 if draw.random() < 0.9 else draw.randrange(9)
            self._put(self._send_id, data[:length], extended=False)
            data = data[length:]
            if draw.random() < 0.02:
                # Frames of another id, or of an extended id with the same number, must be ignored.
                self._put(draw.choice((0, 0x203, 0x7FF)), draw.randbytes(8), extended=False)
                self._put(self._send_id, draw.randbytes(8), extended=True)

    def _put(self, number: int, data: bytes, *, extended: bool) -> None:
        self._feeder.send(can.Message(arbitration_id=number, is_extended_id=extended, data=data))

    def _drain(self) -> None:
        while self._feeder.recv(0) is not None:
            pass


class CanRobot(_Can):
    """The simulated RoboMaster on the CAN bus."""

    _send_id = FROM_COMPANION_ID

    def __init__(self) -> None:
        feeder, end = can_line()
        super().__init__(can_to_robot(), feeder)
        self._node = CanNodeListener(idle_controller(), end, self.accepted.append)

    @property
    def failed_checks(self) -> int:
        """Of whole messages; headers have a checksum of their own."""
        return self._node.stream.parser.checksum_failures

    def _serve(self, now_s: float) -> None:
        self._node.poll(now_s)
        self._drain()


class CanLink(_Can):
    """The transport on the CAN bus."""

    _send_id = FROM_MOTION_CONTROLLER_ID

    def __init__(self) -> None:
        feeder, end = can_line()
        super().__init__(can_from_robot(), feeder)
        self._link = CanLinkListener(end, feeder, self.accepted.append)

    @property
    def failed_checks(self) -> int:
        """Of whole messages; headers have a checksum of their own."""
        return self._link.failed_checks

    def _serve(self, now_s: float) -> None:
        _use(self._link, now_s)
        self._drain()


class _Plaintext(Target):
    filler = b";"

    def _as_read(self, data: bytes) -> bytes:
        return as_text(data.decode("ascii", "replace"))

    def _pieces(self, message: bytes) -> list[bytes]:
        return [piece + b";" for piece in message.split(b";")]


class PlaintextRobot(_Plaintext):
    """The simulated RoboMaster EP's SDK server."""

    def __init__(self) -> None:
        super().__init__(plaintext_to_robot())
        self._port = FedPort()
        self._node = PlaintextNodeListener(idle_controller(), self._port, self.accepted.append)

    def _arrive(self, draw: random.Random, data: bytes) -> None:
        self._port.waiting += data

    def _serve(self, now_s: float) -> None:
        self._node.poll(now_s)


class PlaintextLink(_Plaintext):
    """The plaintext transport; when it reports a lost link, a new one on a new line replaces it."""

    def __init__(self) -> None:
        super().__init__(plaintext_from_robot())
        self._connect()

    def _connect(self) -> None:
        ours, theirs = socket.socketpair()
        self._port = LinePort(theirs.detach())
        self._link = PlaintextLinkListener(ByteStream(ours.detach()), self.accepted.append)
        self._link.open()

    def _arrive(self, draw: random.Random, data: bytes) -> None:
        self._port.answer(data)

    def _serve(self, now_s: float) -> None:
        if not _use(self._link, now_s):
            self.shutdown()
            self._connect()
        self._port.receive()

    def shutdown(self) -> None:
        """Close the line."""
        self._link.close()
        self._port.shutdown()


class _Mavlink(Target):
    filler = bytes(300)

    def __init__(self, traffic: Traffic, feeder: PipeEnd) -> None:
        super().__init__(traffic)
        self._feeder = feeder

    def _arrive(self, draw: random.Random, data: bytes) -> None:
        self._feeder.write(data)

    def _drain(self) -> None:
        while self._feeder.read():
            pass


class Vehicle(_Mavlink):
    """The simulated autopilot; with a key it wants signatures."""

    def __init__(self, key: bytes | None = None) -> None:
        feeder, end = byte_pipe()
        super().__init__(mavlink_to_vehicle(key), feeder)
        self._key = key
        self._vehicle = VehicleListener(end, key, self.accepted.append)

    @property
    def failed_checks(self) -> int:
        """Damaged frames of any kind, most of which have a wrong checksum."""
        return self._vehicle.refused_frames

    def probe_message(self) -> bytes:
        """Signed with a later time than all others, so that it is no replay."""
        codec = MavlinkCodec(1, COMPANION_COMPONENT, self._key, lambda: signing_time() + _LATER)
        return codec.encode(companion_heartbeat(codec.messages))

    def _serve(self, now_s: float) -> None:
        self._vehicle.poll(now_s)
        self._drain()


class VehicleLink(_Mavlink):
    """The MAVLink transport."""

    def __init__(self) -> None:
        feeder, end = byte_pipe()
        super().__init__(mavlink_from_vehicle(), feeder)
        self._clock = SimulatedClock()
        self._link = MavlinkLinkListener(end, self._clock, self.accepted.append)
        # The first message is the heartbeat of a vehicle that is ready.
        self.stream += self.traffic.messages[0]
        feeder.write(self.traffic.messages[0])
        self._link.open()

    @property
    def failed_checks(self) -> int:
        """Damaged frames of any kind, most of which have a wrong checksum."""
        return int(self._link.health()["bad_frames"])

    def _serve(self, now_s: float) -> None:
        self._clock.sleep_until(now_s)
        _use(self._link, now_s)
        self._drain()


TARGETS: dict[str, Callable[[], Target]] = {
    "can robot": CanRobot,
    "can transport": CanLink,
    "plaintext robot": PlaintextRobot,
    "plaintext transport": PlaintextLink,
    "mavlink vehicle": Vehicle,
    "mavlink vehicle, signed": lambda: Vehicle(FAKE_KEY),
    "mavlink transport": VehicleLink,
}


def _use(link: Link, now_s: float) -> bool:
    """Read, and send a command; False when the link says that it is lost or taken over."""
    link.service(now_s)
    try:
        link.send(COMMANDS[0])
    except MtmError:
        return False
    return True
