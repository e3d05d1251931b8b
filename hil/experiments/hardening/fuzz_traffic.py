"""Valid traffic of every wire in both directions; every speed command and every push has different values."""

import random
import struct
from collections.abc import Callable
from typing import Any

from hil.experiments.hardening.mutations import Traffic
from mtm_onboard.links import duml
from mtm_onboard.links.mavlink_codec import MavlinkCodec, dialect
from mtm_onboard.links.mavlink_messages import (
    AUTOPILOT_COMPONENT,
    COMPANION_COMPONENT,
    arm_request,
    companion_heartbeat,
    mode_request,
    velocity_setpoint,
)
from mtm_onboard.links.mavlink_profiles import PROFILES
from mtm_onboard.links.plaintext_messages import FREE_MODE, SUBSCRIBE, numbered, speed_words
from mtm_onboard.links.robomaster_can import SUBSCRIPTION
from mtm_onboard.links.robomaster_messages import (
    HEARTBEAT,
    HEARTBEAT_PAYLOAD,
    SPEED,
    WHEEL_SPEED,
    WORK_MODE,
    speed_payload,
    work_mode_payload,
)
from mtm_onboard.links.robomaster_telemetry import (
    ADD_NODE,
    PUSH,
    UNSUBSCRIBE,
    Telemetry,
    add_node_payload,
    push_payload,
    subscription_payload,
    unsubscription_payload,
)
from mtm_onboard.links.robomaster_telemetry import SUBSCRIBE as SUBSCRIBE_KIND
from mtm_onboard.model.velocity import BodyVelocity

FAKE_KEY = b"simulated, so this is no secret."
COMMANDS = tuple(BodyVelocity(0.01 * n, 0.3 - 0.01 * n, 0.02 * n - 0.5) for n in range(1, 41))

_SYSTEM = 1
_CHECKED_FROM, _PAYLOAD_AT = 1, 10  # in a frame of MAVLink 2
_SIGNATURE_BYTES, _SIGNED = 13, 1


def signing_time() -> int:
    """The time of every signature."""
    return 10**12


def can_to_robot() -> Traffic:
    """What a companion sends."""
    plain = (
        WORK_MODE.message(1, work_mode_payload(True)), WORK_MODE.message(2, work_mode_payload(False)),
        HEARTBEAT.message(3, HEARTBEAT_PAYLOAD), ADD_NODE.message(4, add_node_payload()),
        SUBSCRIBE_KIND.message(5, subscription_payload(SUBSCRIPTION)),
        UNSUBSCRIBE.message(6, unsubscription_payload(SUBSCRIPTION.stream)),
        WHEEL_SPEED.message(7, struct.pack("<4h", 50, -50, -40, 40)),
    )  # fmt: skip
    speeds = tuple(SPEED.message(100 + number, speed_payload(one)) for number, one in enumerate(COMMANDS))
    return _can(plain + speeds)


def can_from_robot() -> Traffic:
    """What a motion controller answers and pushes."""
    pushes = tuple(
        PUSH.message(
            number, push_payload(SUBSCRIPTION, Telemetry(0.1 * number, 0.0, one[:2], one[:2], one[:2], one[2]))
        )
        for number, one in enumerate(COMMANDS)
    )
    answers = tuple(
        kind.message(number, b"").answer(code)
        for number, kind in enumerate((WORK_MODE, SPEED, ADD_NODE, SUBSCRIBE_KIND, UNSUBSCRIBE))
        for code in (b"\x00", b"\x01", b"\x50", b"")
    )
    return _can(pushes + answers)


def plaintext_to_robot() -> Traffic:
    """What a client of the SDK writes, and commands of other clients."""
    plain = (
        b"command;", b"quit;", numbered(FREE_MODE, 1), numbered(SUBSCRIBE, 2), b"version;", b"robot battery ?;",
        b"robot mode ?;", b"robot mode gimbal_lead;", b"chassis push freq 10;", b"chassis position ?;",
        b"chassis attitude ?;", b"chassis status ?;", b"chassis speed ?;", b"chassis wheel w1 50 w2 -50 w3 40 w4 -40;",
    )  # fmt: skip
    speeds = tuple(numbered(speed_words(one), 100 + number) for number, one in enumerate(COMMANDS))
    return Traffic(plain + speeds, b"chassis speed x ;", ())


def plaintext_from_robot() -> Traffic:
    """What the SDK's server answers and pushes."""
    answers = (
        b"ok;", b"ok seq 1;", b"ok seq 2;", b"fail seq 1;", b"Already in SDK mode;", b"version 00.00.00.00;",
        b"command format error: command parse error seq 3;", b"not in sdk mode;", b"84 ;",
    )  # fmt: skip
    pushes = tuple(
        f"chassis push position {one[0]:.3f} {one[1]:.3f} ; attitude 0.000 0.000 {50 * one[2]:.3f} ;;".encode()
        for one in COMMANDS
    )
    return Traffic(answers + pushes, b"chassis push position ;", ())


def mavlink_to_vehicle(key: bytes | None = None) -> Traffic:
    """What a companion sends, signed under `key`."""
    codec, copter = MavlinkCodec(_SYSTEM, COMPANION_COMPONENT, key, signing_time), PROFILES["copter"]
    messages = codec.messages
    plain = [companion_heartbeat(messages), mode_request(messages, copter, _SYSTEM, 0), arm_request(messages, 1, 0)]
    plain += [velocity_setpoint(messages, copter, _SYSTEM, one, 1.0) for one in COMMANDS]
    return _mavlink(codec, plain)


def mavlink_from_vehicle() -> Traffic:
    """What an autopilot says."""
    codec = MavlinkCodec(_SYSTEM, AUTOPILOT_COMPONENT)
    messages = codec.messages
    plain = [
        messages.MAVLink_heartbeat_message(2, 3, 1 | 128, 4, 4, 3),
        messages.MAVLink_heartbeat_message(2, 3, 1, 5, 4, 3),
        messages.MAVLink_command_ack_message(176, 0), messages.MAVLink_command_ack_message(400, 4),
        messages.MAVLink_statustext_message(2, b"Arm: checks failed"),
    ]  # fmt: skip
    for number, one in enumerate(COMMANDS):
        plain.append(messages.MAVLink_attitude_message(number, 0.0, 0.0, one[2], 0.0, 0.0, one[2]))
        plain.append(messages.MAVLink_local_position_ned_message(number, *one, *one))
    return _mavlink(codec, plain)


def _telemetry(number: int, one: BodyVelocity) -> Telemetry:
    planar = one.vx_mps, one.vy_mps
    return Telemetry(0.1 * number, 0.0, planar, planar, planar, one.wz_radps)


def _can(messages: tuple[duml.Message, ...]) -> Traffic:
    return Traffic(tuple(map(duml.encode, messages)), bytes((duml.START,)), (1, 2), _sealed_duml)


def _sealed_duml(draw: random.Random, message: bytes) -> bytes:
    (plain,) = duml.Parser().feed(message)
    payload = _another(draw, plain.payload)
    attributes = draw.choice((plain.attributes, draw.randrange(256)))
    return duml.encode(
        duml.Message(
            sender=plain.sender,
            receiver=plain.receiver,
            sequence=draw.randrange(65_536),
            attributes=attributes,
            cmdset=plain.cmdset,
            cmdid=plain.cmdid,
            payload=payload,
        )
    )


def _mavlink(codec: MavlinkCodec, messages: list[Any]) -> Traffic:
    frames = tuple(codec.encode(message) for message in messages)
    return Traffic(frames, b"\xfd", (1, 2), _mavlink_seal())


def _mavlink_seal() -> Callable[[random.Random, bytes], bytes]:
    messages = dialect()

    def seal(draw: random.Random, frame: bytes) -> bytes:
        """Other content with a correct checksum; a signature is kept, and is then wrong."""
        end = _PAYLOAD_AT + frame[1]
        signature = frame[-_SIGNATURE_BYTES:] if frame[2] & _SIGNED else b""
        payload = _another(draw, frame[_PAYLOAD_AT:end])[:255]
        checked = bytes((len(payload),)) + frame[2:_PAYLOAD_AT] + payload
        extra = messages.mavlink_map[int.from_bytes(frame[7:_PAYLOAD_AT], "little")].crc_extra
        checksum = messages.x25crc(checked + bytes((extra,))).crc
        return frame[:_CHECKED_FROM] + checked + struct.pack("<H", checksum) + signature

    return seal


def _another(draw: random.Random, payload: bytes) -> bytes:
    """A payload of about the same length with some or all bytes changed."""
    changed = bytearray(draw.randbytes(len(payload)) if draw.random() < 0.3 else payload)
    for _ in range(draw.randint(0, 4)):
        if changed:
            changed[draw.randrange(len(changed))] = draw.choice((0, 0x7F, 0x80, 0xC0, 0xFF, draw.randrange(256)))
    extra = draw.choice((0, 0, 0, 0, -1, 1, -4, 8))
    return bytes(changed[: len(changed) + extra] if extra < 0 else changed + draw.randbytes(extra))
