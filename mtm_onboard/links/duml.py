"""DJI's message format: one message to bytes and back, and a parser for a stream of them.

A message is 0x55, a length of 10 bits with version 1 above it, a CRC-8 of those three bytes, sender, receiver, a
16-bit sequence, attributes, command set, command id, payload, and a CRC-16 of everything before it; all numbers are
little-endian. The format is that of DJI's open SDK and of messages captured on a RoboMaster S1's bus.
"""

import binascii
import struct
from dataclasses import dataclass
from typing import Final

START: Final = 0x55
OVERHEAD: Final = 13  # header and both checksums
MAX_LENGTH: Final = 1023
CAN_FRAME_BYTES: Final = 8

ACK: Final = 0x80  # attributes: this message is an answer
WANTS_ACK_NOW: Final = 0x20
WANTS_ACK_WHEN_DONE: Final = 0x40
WANTS_ACK: Final = WANTS_ACK_NOW | WANTS_ACK_WHEN_DONE

_HEADER_BYTES = 4
_FIELDS = struct.Struct("<BBHBBB")
_CHECKSUM = struct.Struct("<H")


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """One message. `sender` and `receiver` are host bytes, `attributes` holds the acknowledgement bits."""

    sender: int
    receiver: int
    sequence: int
    attributes: int
    cmdset: int
    cmdid: int
    payload: bytes = b""

    def answer(self, payload: bytes) -> "Message":
        """The acknowledgement of this message: hosts swapped, everything else but the payload kept."""
        return Message(
            sender=self.receiver,
            receiver=self.sender,
            sequence=self.sequence,
            attributes=ACK,
            cmdset=self.cmdset,
            cmdid=self.cmdid,
            payload=payload,
        )


def _crc8_table() -> bytes:
    table = bytearray()
    for register in range(256):
        for _ in range(8):
            register = (register >> 1) ^ (0x8C if register & 1 else 0)
        table.append(register)
    return bytes(table)


_CRC8 = _crc8_table()
_MIRRORED = bytes(int(f"{value:08b}"[::-1], 2) for value in range(256))


def crc8(data: bytes) -> int:
    """Header checksum: polynomial 0x31 reflected, register starting at 0x77."""
    register = 0x77
    for value in data:
        register = _CRC8[register ^ value]
    return register


def crc16(data: bytes | bytearray) -> int:
    """Message checksum: polynomial 0x1021 reflected, register starting at 0x3692.

    The standard library computes the same polynomial the other way round, so bits are mirrored going in and out.
    """
    register = binascii.crc_hqx(data.translate(_MIRRORED), 0x496C)
    return _MIRRORED[register & 0xFF] << 8 | _MIRRORED[register >> 8]


def _header(length: int) -> bytes:
    head = bytes((START, length & 0xFF, 0x04 | length >> 8))
    return head + bytes((crc8(head),))


# The four first bytes depend on the length alone, so a header is checked by comparing it with the one it should be.
_HEADERS = [_header(length) for length in range(MAX_LENGTH + 1)]


def encode(message: Message) -> bytes:
    """The bytes of `message`; raises ValueError when a field does not fit."""
    length = OVERHEAD + len(message.payload)
    if length > MAX_LENGTH:
        raise ValueError(f"a payload of {len(message.payload)} bytes is over the limit of {MAX_LENGTH - OVERHEAD}")
    try:
        fields = _FIELDS.pack(
            message.sender, message.receiver, message.sequence, message.attributes, message.cmdset, message.cmdid
        )
    except struct.error as error:
        raise ValueError(f"a field of {message} does not fit its bytes: {error}") from None
    body = _HEADERS[length] + fields + message.payload
    return body + _CHECKSUM.pack(crc16(body))


def segment(data: bytes) -> list[bytes]:
    """Cut one message into CAN frames; the message starts a frame of its own and the last frame may be short."""
    return [data[start : start + CAN_FRAME_BYTES] for start in range(0, len(data), CAN_FRAME_BYTES)]


class Parser:
    """Takes the bytes of one CAN id in any portions and returns the messages in them.

    There is no marker but the checksums: whatever fails one of them loses its first byte and is looked at again. A
    header that is sound by accident can claim up to 1023 bytes, so a complete message found inside one that is still
    waiting for its end overtakes it. At most 1022 bytes are kept between calls.
    """

    def __init__(self) -> None:
        self.dropped_bytes = 0
        self.header_failures = 0
        self.checksum_failures = 0
        self._buffer = bytearray()

    def feed(self, data: bytes | bytearray) -> list[Message]:
        """Append `data` and return every message that is complete now."""
        self._buffer += data
        messages = []
        while (message := self._next()) is not None:
            messages.append(message)
        return messages

    def _next(self) -> Message | None:
        buffer = self._buffer
        while buffer:
            start = buffer.find(START)
            if start:
                self._drop(len(buffer) if start < 0 else start)
            if len(buffer) < _HEADER_BYTES:
                return None
            length = _claimed_length(buffer, 0)
            if not length:
                self.header_failures += 1
                self._drop(1)
            elif length > len(buffer):
                return self._overtaking()
            elif _is_sound(buffer, 0, length):
                return self._take(length)
            else:
                self.checksum_failures += 1
                self._drop(1)
        return None

    def _overtaking(self) -> Message | None:
        """The first complete message inside the unfinished one at the front of the buffer."""
        buffer = self._buffer
        start = buffer.find(START, 1)
        while start > 0 and len(buffer) - start >= OVERHEAD:
            length = _claimed_length(buffer, start)
            if length and start + length <= len(buffer) and _is_sound(buffer, start, length):
                self._drop(start)
                return self._take(length)
            start = buffer.find(START, start + 1)
        return None

    def _take(self, length: int) -> Message:
        buffer = self._buffer
        sender, receiver, sequence, attributes, cmdset, cmdid = _FIELDS.unpack_from(buffer, _HEADER_BYTES)
        payload = bytes(buffer[_HEADER_BYTES + _FIELDS.size : length - _CHECKSUM.size])
        del buffer[:length]
        return Message(
            sender=sender,
            receiver=receiver,
            sequence=sequence,
            attributes=attributes,
            cmdset=cmdset,
            cmdid=cmdid,
            payload=payload,
        )

    def _drop(self, count: int) -> None:
        self.dropped_bytes += count
        del self._buffer[:count]


def _claimed_length(buffer: bytearray, start: int) -> int:
    """The length that the header at `start` claims, 0 when it is no sound header."""
    length = buffer[start + 1] | (buffer[start + 2] & 0x03) << 8
    return length if length >= OVERHEAD and buffer[start : start + _HEADER_BYTES] == _HEADERS[length] else 0


def _is_sound(buffer: bytearray, start: int, length: int) -> bool:
    checksum_at = start + length - _CHECKSUM.size
    return bool(crc16(buffer[start:checksum_at]) == _CHECKSUM.unpack_from(buffer, checksum_at)[0])
