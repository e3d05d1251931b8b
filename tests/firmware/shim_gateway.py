"""A board of two CAN lines in memory around the C gateway."""

import struct
from collections import deque
from typing import NamedTuple

from mtm_onboard.firmware.image import ONE
from tests.firmware.shim_player import ShimPlayer

COMPANION, CONTROLLER = 0, 1
STREAM = 0x201


class Frame(NamedTuple):
    """One CAN frame."""

    id: int
    data: bytes


class Board:
    """Frames put into `arriving[side]` reach the gateway at the next `poll`; what it sends collects in `sent[side]`."""

    def __init__(self, player: ShimPlayer, *, fill: bool = False, room: int = 1 << 30) -> None:
        self.player, self.ffi, self.lib = player, player.ffi, player.lib
        self.now_us = 1_000_000
        self.room = room
        self.stop = False
        self.arriving: tuple[deque[Frame], deque[Frame]] = (deque(), deque())
        self.sent: tuple[list[Frame], list[Frame]] = ([], [])
        self.alive = 0
        callback = self.ffi.callback
        self._callbacks = (
            callback("uint32_t(void *)", lambda _: self.now_us & 0xFFFFFFFF),
            callback("uint8_t(void *, uint8_t, mtm_frame *)", self._receive),
            callback("uint8_t(void *, uint8_t, const mtm_frame *)", self._send),
            callback("uint8_t(void *)", lambda _: self.stop),
            callback("void(void *, const mtm_shim *)", self._status),
        )
        self._board = self.ffi.new("mtm_board *", [self.ffi.NULL, *self._callbacks])
        self.gateway = self.ffi.new("mtm_gateway *")
        self.lib.mtm_gateway_init(self.gateway, player.shim, self._board, fill)

    @property
    def counts(self):
        return self.gateway.counts

    def poll(self) -> None:
        self.lib.mtm_gateway_poll(self.gateway)

    def run(self, span_us: int, step_us: int = 1000) -> list[bytes]:
        """Poll for that long; the messages that the gateway sent to the controller meanwhile."""
        before = len(self.sent[CONTROLLER])
        for _ in range(span_us // step_us):
            self.now_us += step_us
            self.poll()
        return whole_messages(self.sent[CONTROLLER][before:])

    def pass_on(self, frames: list[Frame], gap_us: int = 130) -> list[Frame]:
        """Give frames one by one; what went to the controller."""
        before = len(self.sent[CONTROLLER])
        for frame in frames:
            self.arriving[COMPANION].append(frame)
            self.poll()
            self.now_us += gap_us
        return self.sent[CONTROLLER][before:]

    def _receive(self, _: object, side: int, frame) -> int:
        if not self.arriving[side]:
            return 0
        taken = self.arriving[side].popleft()
        frame.id, frame.size = taken.id, len(taken.data)
        frame.data = taken.data[:8].ljust(8, b"\0")
        return 1

    def _send(self, _: object, side: int, frame) -> int:
        if self.room == 0:
            return 0
        self.room -= 1
        self.sent[side].append(Frame(frame.id, bytes(frame.data[0 : frame.size])))
        return 1

    def _status(self, _: object, shim) -> None:
        self.alive += 1


def aligned(message: bytes, can_id: int = STREAM) -> list[Frame]:
    return cut(message, 8, can_id)


def cut(data: bytes, size: int, can_id: int = STREAM) -> list[Frame]:
    return [Frame(can_id, data[at : at + size]) for at in range(0, len(data), size)]


def stream(frames: list[Frame], can_id: int = STREAM) -> bytes:
    return b"".join(frame.data for frame in frames if frame.id == can_id)


def whole_messages(frames: list[Frame]) -> list[bytes]:
    """Messages of the stream, found by the parser of other tests' own checking."""
    from tests.firmware.test_wire import parsed

    return parsed(stream(frames))


def speed_message(x: float, y: float, z: float, sequence: int = 0, attributes: int = 0) -> bytes:
    """A speed command in the wire's own terms: m/s, y right, degrees per second clockwise."""
    from tests.firmware.test_wire import built

    return built(0xC9, 0xC3, sequence, attributes, 0x3F, 0x21, struct.pack("<3f", x, y, z))


def wire_speeds(message: bytes) -> tuple[float, float, float]:
    assert message[9:11] == b"\x3f\x21"
    assert len(message) == 25
    return struct.unpack_from("<3f", message, 11)


def on_the_wire(velocity_q20) -> list[float]:
    """REP-103 units of 2**-20 as the wire states them."""
    x, y, z = (value / ONE for value in velocity_q20)
    return [x, -y, -z * 180 / 3.141592653589793]
