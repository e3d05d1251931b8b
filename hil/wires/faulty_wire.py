"""Faulty wires in simulated time: a CAN bus, a line of text and a MAVLink port with the same kinds of faults.

A wire carries units: CAN frames, texts that end with a semicolon, MAVLink frames. The faults of the two directions are
independent.
"""

import errno
import random
from collections import deque
from dataclasses import dataclass

import can

from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.robomaster_messages import FROM_COMPANION_ID, FROM_MOTION_CONTROLLER_ID
from mtm_onboard.model.clock import Clock
from mtm_onboard.protocol import MtmError

_MAX_BYTES_CHANGED = 3


@dataclass(frozen=True, kw_only=True)
class WireFaults:
    """Faults of one direction.

    `drop`, `duplicate`, `corrupt` (up to three bytes changed) and `reorder` (overtaken by the next unit) are
    probabilities for each unit. `delay_s` bounds a unit's delay, which keeps the order. For `block_s` in each
    `block_every_s` the wire accepts nothing.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    reorder: float = 0.0
    delay_s: tuple[float, float] = (0.0, 0.0)
    block_s: float = 0.0
    block_every_s: float = 0.47  # no multiple of a tick or of the time between attempts to open a link


class Direction:
    """One direction of a wire: units go in by `put` and come out by `take` when they are due."""

    def __init__(self, wire: "FaultyWire", draw: random.Random) -> None:
        self._wire = wire
        self._draw = draw
        self._in_transit: deque[tuple[float, bytes]] = deque()
        self._overtaken: bytes | None = None

    def put(self, unit: bytes) -> None:
        """Send a unit; it never arrives while the wire swallows."""
        wire, draw = self._wire, self._draw
        if wire.swallows:
            return
        faults = wire.faults
        if draw.random() < faults.drop:
            return
        if draw.random() < faults.corrupt:
            unit = _corrupted(draw, unit)
        if self._overtaken is None and draw.random() < faults.reorder:
            self._overtaken = unit
            return
        self._send(unit)
        if draw.random() < faults.duplicate:
            self._send(unit)
        if self._overtaken is not None:
            self._send(self._overtaken)
            self._overtaken = None

    def take(self) -> bytes | None:
        """The next unit that has arrived."""
        if self._in_transit and self._in_transit[0][0] <= self._wire.clock.now() + 1e-9:
            return self._in_transit.popleft()[1]
        return None

    def clear(self) -> None:
        """Lose all units in transit."""
        self._in_transit.clear()
        self._overtaken = None

    def _send(self, unit: bytes) -> None:
        due_s = self._wire.clock.now() + self._draw.uniform(*self._wire.faults.delay_s)
        if self._in_transit:
            due_s = max(due_s, self._in_transit[-1][0])
        self._in_transit.append((due_s, unit))


class FaultyWire:
    """Both directions, with `faults` that may be changed at any time.

    `cut` loses what is in transit and makes every write fail until `restore`; a wire that `swallows` accepts everything
    and delivers nothing.
    """

    def __init__(self, clock: Clock, seed: int) -> None:
        self.clock = clock
        self.faults = WireFaults()
        self.swallows = False
        self.is_cut = False
        self.to_robot = Direction(self, random.Random(f"to robot {seed}"))
        self.from_robot = Direction(self, random.Random(f"from robot {seed}"))

    def cut(self) -> None:
        """Unplug it."""
        self.is_cut = True
        self.to_robot.clear()
        self.from_robot.clear()

    def restore(self) -> None:
        """Plug it in again, and deliver again."""
        self.is_cut = self.swallows = False

    @property
    def is_blocked(self) -> bool:
        """Whether the wire accepts nothing from our end at this time."""
        faults = self.faults
        return faults.block_s > 0.0 and self.clock.now() % faults.block_every_s < faults.block_s


class FaultyBus:
    """One node's end of a CAN bus over the wire: the companion's, or the robot's."""

    def __init__(self, wire: FaultyWire, *, is_robot: bool) -> None:
        self._wire = wire
        self._is_robot = is_robot
        self._out, self._in = wire.to_robot, wire.from_robot
        self._receive_id = FROM_MOTION_CONTROLLER_ID
        if is_robot:
            self._out, self._in = self._in, self._out
            self._receive_id = FROM_COMPANION_ID

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Raises can.CanOperationError when the bus is off or its queue is full."""
        if not self._is_robot:
            self._check()
            if self._wire.is_blocked:
                raise can.CanOperationError("transmit buffer full", errno.ENOBUFS)
        self._out.put(bytes(msg.data))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that has arrived; raises can.CanOperationError when the bus is off."""
        if not self._is_robot:
            self._check()
        data = self._in.take()
        if data is None:
            return None
        return can.Message(arbitration_id=self._receive_id, is_extended_id=False, data=data)

    def shutdown(self) -> None:
        """Nothing: the next node uses the same wire."""

    def _check(self) -> None:
        if self._wire.is_cut:
            raise can.CanOperationError("bus off")


class FaultyText(ByteStream):
    """Our end of a line of text over the wire, in the place of a descriptor's."""

    def __init__(self, wire: FaultyWire) -> None:
        self._wire = wire

    def write(self, message: bytes, within_s: float) -> None:
        """Raises LinkBusyError when the line is full and MtmError when it is unplugged."""
        _check_write(self._wire)
        for text in message.split(b";")[:-1]:
            self._wire.to_robot.put(text + b";")

    def read(self) -> bytes:
        """What has arrived; raises MtmError when the line is unplugged."""
        if self._wire.is_cut:
            raise MtmError("the line is unplugged; plug it in")
        return _all_of(self._wire.from_robot)

    def close(self) -> None:
        """Nothing: the next link uses the same wire."""


class FaultyTextPort:
    """The robot's end of a line of text, which cannot tell whether the other end is connected."""

    def __init__(self, wire: FaultyWire) -> None:
        self._wire = wire

    def receive(self) -> bytes | None:
        """What has arrived."""
        return _all_of(self._wire.to_robot)

    def answer(self, text: bytes) -> None:
        """Answer a command."""
        if not self._wire.is_cut:
            self._wire.from_robot.put(text)

    push = answer

    def shutdown(self) -> None:
        """There is nothing to release."""


class FaultyPort:
    """One end of a MAVLink wire: the companion's, or the vehicle's."""

    def __init__(self, wire: FaultyWire, *, is_robot: bool) -> None:
        self._wire = wire
        self._is_robot = is_robot
        self._out, self._in = (wire.from_robot, wire.to_robot) if is_robot else (wire.to_robot, wire.from_robot)

    def write(self, frame: bytes) -> None:
        """Raises LinkBusyError when the wire takes nothing and MtmError when it is unplugged."""
        if not self._is_robot:
            _check_write(self._wire)
        if not self._wire.is_cut:
            self._out.put(frame)

    def read(self) -> bytes:
        """The next frame that has arrived; raises MtmError at our end of a wire that is unplugged."""
        if self._wire.is_cut and not self._is_robot:
            raise MtmError("the wire is unplugged; plug it in")
        return self._in.take() or b""

    def keep_sender(self) -> None:
        """Nothing: there is one other end."""

    def close(self) -> None:
        """Discard what was not read."""
        if not self._is_robot:
            self._in.clear()


def _check_write(wire: FaultyWire) -> None:
    if wire.is_cut:
        raise MtmError("the wire is unplugged; plug it in")
    if wire.is_blocked:
        raise LinkBusyError("the wire takes nothing")


def _all_of(direction: Direction) -> bytes:
    parts = []
    while (unit := direction.take()) is not None:
        parts.append(unit)
    return b"".join(parts)


def _corrupted(draw: random.Random, unit: bytes) -> bytes:
    changed = bytearray(unit)
    for _ in range(draw.randint(1, _MAX_BYTES_CHANGED)):
        if changed:
            changed[draw.randrange(len(changed))] ^= draw.randint(1, 255)
    return bytes(changed)
