"""The RoboMaster commands: which hosts they run between, and their payloads.

DJI counts y to the right, yaw clockwise and angles in degrees; everything else in this project is REP-103.
`flipped`, `clockwise_deg` and `counter_clockwise_rad` are the one place where the two meet. Velocities travel as 32-bit
floats and are never rounded further (DJI's own client rounds to 0.01 m/s and 1 deg/s, which would erase the noise).
Layouts follow DJI's open SDK and captures of a real robot's bus.
"""

import math
import struct
from dataclasses import dataclass
from typing import Any, Final

from mtm_onboard.links.duml import WANTS_ACK_WHEN_DONE, Message
from mtm_onboard.model.velocity import BodyVelocity

BITRATE: Final = 1_000_000
FROM_COMPANION_ID: Final = 0x201  # CAN id of the intelligent controller, whose place a companion computer takes
FROM_MOTION_CONTROLLER_ID: Final = 0x202
HEARTBEAT_PERIOD_S: Final = 0.010

COMPANION: Final = 0x09
COMPANION_SCRIPT: Final = 0xC9
CHASSIS: Final = 0xC3
PUBLISHER: Final = 0x03  # the half of the motion controller that telemetry is asked from

_SPEED = struct.Struct("<fff")
_WHEELS = struct.Struct("<hhhh")


@dataclass(frozen=True)
class Kind:
    """A kind of message: everything but its sequence number and payload."""

    sender: int
    receiver: int
    attributes: int
    cmdset: int
    cmdid: int

    def message(self, sequence: int, payload: bytes) -> Message:
        """One message of this kind."""
        return Message(
            sender=self.sender,
            receiver=self.receiver,
            sequence=sequence,
            attributes=self.attributes,
            cmdset=self.cmdset,
            cmdid=self.cmdid,
            payload=payload,
        )

    def matches(self, message: Message) -> bool:
        """Whether `message` has this kind's command, whoever sent it."""
        return message.cmdset == self.cmdset and message.cmdid == self.cmdid


WORK_MODE: Final = Kind(COMPANION, CHASSIS, WANTS_ACK_WHEN_DONE, 0x3F, 0x19)
WHEEL_SPEED: Final = Kind(COMPANION_SCRIPT, CHASSIS, 0, 0x3F, 0x20)
SPEED: Final = Kind(COMPANION_SCRIPT, CHASSIS, 0, 0x3F, 0x21)
HEARTBEAT: Final = Kind(COMPANION, CHASSIS, 0, 0x3F, 0x60)

# The remote-control frame with every stick centred (seven channels of 11 bits at 1024, the fourth 0) and no channel
# in use: what a real controller sends while nobody touches the sticks.
HEARTBEAT_PAYLOAD: Final = bytes.fromhex("0004200001004000021004030004")


def flipped(value: float) -> float:
    """A y coordinate, or an angle, with DJI's sign from ours or ours from DJI's; zero stays a positive zero."""
    return 0.0 - value


def clockwise_deg(angle_rad: float) -> float:
    """Degrees clockwise from radians counter-clockwise (or their rates)."""
    return 0.0 - math.degrees(angle_rad)


def counter_clockwise_rad(angle_deg: float) -> float:
    """Radians counter-clockwise from degrees clockwise (or their rates)."""
    return 0.0 - math.radians(angle_deg)


def work_mode_payload(on: bool) -> bytes:
    """Payload that engages (True) or releases the motors."""
    return b"\x01" if on else b"\x00"


def is_work_mode_on(payload: bytes) -> bool:
    """What a work mode payload asks for; raises ValueError when it is neither on nor off."""
    if payload not in (b"\x00", b"\x01"):
        raise ValueError(f"a work mode is one byte, 0 or 1, not {payload.hex() or 'nothing'}")
    return payload == b"\x01"


def speed_payload(velocity: BodyVelocity) -> bytes:
    """Payload of a speed command: forward and rightward m/s, clockwise deg/s.

    Raises ValueError for values that are not finite or do not fit a 32-bit float.
    """
    if not velocity.is_finite():
        raise ValueError(f"the command {tuple(velocity)} is not finite; send finite speeds only")
    clockwise_degps = clockwise_deg(velocity.wz_radps)
    try:
        payload = _SPEED.pack(velocity.vx_mps, flipped(velocity.vy_mps), clockwise_degps)
    except OverflowError:
        payload = None
    if payload is None or math.isinf(clockwise_degps):
        raise ValueError(f"the command {tuple(velocity)} does not fit 32-bit floats; send speeds a robot can drive")
    return payload


def speed_velocity(payload: bytes) -> BodyVelocity:
    """The velocity of a speed command's payload; NaN and infinity are passed on for the caller to judge.

    Raises ValueError when the payload has another length.
    """
    forward_mps, rightward_mps, clockwise_degps = _unpacked(_SPEED, payload)
    return BodyVelocity(forward_mps, flipped(rightward_mps), counter_clockwise_rad(clockwise_degps))


def wheel_rpm(payload: bytes) -> tuple[int, int, int, int]:
    """Forward-positive wheel speeds (front left, front right, rear left, rear right) in turns a minute.

    The payload runs front right, front left, rear left, rear right, with the left side counted backwards. Raises
    ValueError when it has another length.
    """
    front_right, front_left, rear_left, rear_right = _unpacked(_WHEELS, payload)
    return -front_left, front_right, -rear_left, rear_right


class SequenceCounters:
    """Sequence numbers as the real controller counts them: from 0, one counter for each pair of hosts, 16 bits."""

    def __init__(self) -> None:
        self._next: dict[tuple[int, int], int] = {}

    def next(self, kind: Kind) -> int:
        """The number of the next message of `kind`'s hosts."""
        pair = kind.sender, kind.receiver
        number = self._next.get(pair, 0)
        self._next[pair] = (number + 1) & 0xFFFF
        return number


def _unpacked(layout: struct.Struct, payload: bytes) -> tuple[Any, ...]:
    if len(payload) != layout.size:
        raise ValueError(f"the payload {payload.hex()} should be {layout.size} bytes long")
    return layout.unpack(payload)
