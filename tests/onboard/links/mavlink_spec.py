"""A second reader of MAVLink 2, written from the public serialization guide and message definitions alone.

Definitions stand as in the common message set: fields in the order of definition, extensions after "extensions". Wire
order, check bytes and sizes follow from them. Nothing here uses pymavlink.
"""

import hashlib
import struct
from dataclasses import dataclass

_FORMATS = {"uint32_t": "I", "int32_t": "i", "float": "f", "uint16_t": "H", "uint8_t": "B", "char": "c"}

_DEFINITIONS = {
    0: ("HEARTBEAT", "uint8_t type, uint8_t autopilot, uint8_t base_mode, uint32_t custom_mode, uint8_t system_status, "
        "uint8_t mavlink_version"),
    30: ("ATTITUDE", "uint32_t time_boot_ms, float roll, float pitch, float yaw, float rollspeed, float pitchspeed, "
         "float yawspeed"),
    32: ("LOCAL_POSITION_NED", "uint32_t time_boot_ms, float x, float y, float z, float vx, float vy, float vz"),
    76: ("COMMAND_LONG", "uint8_t target_system, uint8_t target_component, uint16_t command, uint8_t confirmation, "
         "float param1, float param2, float param3, float param4, float param5, float param6, float param7"),
    77: ("COMMAND_ACK", "uint16_t command, uint8_t result, extensions, uint8_t progress, int32_t result_param2, "
         "uint8_t target_system, uint8_t target_component"),
    84: ("SET_POSITION_TARGET_LOCAL_NED", "uint32_t time_boot_ms, uint8_t target_system, uint8_t target_component, "
         "uint8_t coordinate_frame, uint16_t type_mask, float x, float y, float z, float vx, float vy, float vz, "
         "float afx, float afy, float afz, float yaw, float yaw_rate"),
    253: ("STATUSTEXT", "uint8_t severity, char[50] text, extensions, uint16_t id, uint8_t chunk_seq"),
}  # fmt: skip


@dataclass(frozen=True)
class Field:
    kind: str
    name: str
    length: int = 0

    @property
    def size(self) -> int:
        return struct.calcsize("<" + _FORMATS[self.kind])

    @property
    def format(self) -> str:
        return f"{self.length}s" if self.kind == "char" else _FORMATS[self.kind]


@dataclass(frozen=True)
class Frame:
    """One frame as it was on the wire, `fields` by name; `signature` is link, time and six bytes, or None."""

    name: str
    sequence: int
    system: int
    component: int
    fields: dict
    signature: tuple[int, int, bytes] | None
    payload_length: int


def x25(data: bytes, crc: int = 0xFFFF) -> int:
    """CRC-16/MCRF4XX bit by bit."""
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def layout(number: int) -> tuple[str, list[Field], int]:
    """Name, fields in wire order, and the check byte that stands for the definition."""
    name, definition = _DEFINITIONS[number]
    base, _, extensions = definition.partition(", extensions, ")
    own, later = [[_field(text) for text in part.split(", ")] if part else [] for part in (base, extensions)]
    own.sort(key=lambda field: -field.size)  # stable; extensions are never moved
    text = name + " " + "".join(f"{field.kind} {field.name} " + chr(field.length) * bool(field.length) for field in own)
    crc = x25(text.encode())
    return name, own + later, crc & 0xFF ^ crc >> 8


def read_frame(data: bytes, key: bytes | None = None) -> tuple[Frame, bytes]:
    """The frame at the beginning of `data` and what follows it; every check must hold."""
    magic, length, incompatible, compatible, sequence, system, component = data[:7]
    assert (magic, compatible) == (0xFD, 0)
    assert incompatible == (0 if key is None else 1)
    name, fields, check_byte = layout(int.from_bytes(data[7:10], "little"))
    payload, end = data[10 : 10 + length], 12 + length
    assert int.from_bytes(data[end - 2 : end], "little") == x25(data[1 : end - 2] + bytes((check_byte,)))
    assert length == 1 or payload[-1] != 0, "trailing zeros are cut off, but for the first byte"
    signature = None
    if key is not None:
        signed, end = data[: end + 7], end + 13
        signature = signed[-7], int.from_bytes(signed[-6:], "little"), data[end - 6 : end]
        assert signature[2] == hashlib.sha256(key + signed).digest()[:6]
    whole = struct.Struct("<" + "".join(field.format for field in fields))
    values = whole.unpack(payload.ljust(whole.size, b"\x00"))
    named = {field.name: value for field, value in zip(fields, values, strict=True)}
    return Frame(name, sequence, system, component, named, signature, length), data[end:]


def read_frames(data: bytes, key: bytes | None = None) -> list[Frame]:
    """All of them, back to back."""
    found = []
    while data:
        frame, data = read_frame(data, key)
        found.append(frame)
    return found


def _field(text: str) -> Field:
    kind, name = text.split(" ")
    kind, _, length = kind.rstrip("]").partition("[")
    return Field(kind, name, int(length or 0))
