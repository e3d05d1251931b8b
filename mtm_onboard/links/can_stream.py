"""DJI's messages over a CAN bus, where each CAN id is one stream of bytes."""

import errno
import select
import time
from typing import TYPE_CHECKING

from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.can_bus import Bus
from mtm_onboard.links.duml import Message, Parser, encode, segment
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command

if TYPE_CHECKING:
    import can

_WRITE_WITHIN_S = 0.1  # below the robot's deadman
_SHORTEST_TIMEOUT_S = 0.001
_MOST_FRAMES_A_READ = 512  # so that a babbling bus cannot hold its reader for ever


class CanStream:
    """Writes messages under one 11-bit id of `bus` and reads those that arrive under another.

    Raises MtmError when python-can is missing. Writing from several threads needs a lock around whole messages.
    `error_frames` counts what the bus's controller said of errors on it.
    """

    def __init__(self, bus: Bus, send_id: int, receive_id: int) -> None:
        try:
            import can
        except ImportError:
            raise MtmError(
                f"CAN needs python-can, which is not installed; install it with: {install_command('can')}"
            ) from None
        self.parser = Parser()
        self.error_frames = 0
        self._bus = bus
        self._send_id = send_id
        self._receive_id = receive_id
        self._frame = can.Message
        self._errors = (can.CanError, OSError, ValueError)  # ValueError: the descriptor of a closed bus
        self._descriptor = _descriptor(bus)
        self._reads_ahead = hasattr(bus, "has_waiting")

    def write(self, message: Message, within_s: float = _WRITE_WITHIN_S) -> None:
        """Put one message on the bus, in `within_s` seconds at most.

        Raises LinkBusyError when the bus did not take all of it in time and MtmError when it refuses a frame.
        """
        deadline_s = time.monotonic() + within_s
        try:
            for data in segment(encode(message)):
                self._send(self._frame(arbitration_id=self._send_id, is_extended_id=False, data=data), deadline_s)
        except self._errors as error:
            # A queue that is full is a bus on which nobody acknowledges, or one that is busy for a moment.
            if getattr(error, "error_code", None) == errno.ENOBUFS or time.monotonic() >= deadline_s:
                raise _busy(str(error)) from error
            raise MtmError(f"The CAN bus refused a frame ({error}); check the wiring and the robot's power.") from error

    def read(self) -> list[Message]:
        """Every message that is complete by now, without waiting; raises MtmError when the bus cannot be read."""
        data = bytearray()
        try:
            for _ in range(_MOST_FRAMES_A_READ):
                if self._is_quiet():
                    break
                frame = self._bus.recv(0)
                if frame is None:
                    if self._descriptor is None:
                        break
                elif frame.is_error_frame:
                    self.error_frames += 1
                elif frame.arbitration_id == self._receive_id and not frame.is_extended_id:
                    data += frame.data
        except self._errors as error:
            raise MtmError(f"The CAN bus cannot be read ({error}); check the wiring and the robot's power.") from error
        return self.parser.feed(data)

    @property
    def adapter_answers(self) -> tuple[int, int]:
        """How many frames the adapter said that it rejected, and that it took; zeros where it says nothing."""
        answers = getattr(self._bus, "answers", None)
        return (0, 0) if answers is None else (answers.rejected, answers.took)

    def shutdown(self) -> None:
        """Release the bus, also one that is gone."""
        try:
            self._bus.shutdown()
        except self._errors:
            # python-can leaves the port of an adapter that takes no farewell open, and plugged in again the adapter
            # would come up under another name.
            serial_port = getattr(self._bus, "serialPortOrig", None)
            if serial_port is not None:
                serial_port.close()

    def _send(self, frame: "can.Message", deadline_s: float) -> None:
        remaining_s = max(_SHORTEST_TIMEOUT_S, deadline_s - time.monotonic())
        if self._descriptor is None:
            self._bus.send(frame, timeout=remaining_s)
            return
        # Asked of the descriptor, since pyserial takes a host that stalled after its write for a line that is full,
        # and then half a message would have left. What is writable takes a frame at once.
        if not select.select((), [self._descriptor], (), remaining_s)[1]:
            raise _busy("the line is full")
        self._bus.send(frame, timeout=0)

    def _is_quiet(self) -> bool:
        """Whether nothing waits behind the bus's file descriptor, nor in the bus; False when it has no descriptor.

        A serial adapter's `recv(0)` waits a millisecond when there is nothing, and gives None for an adapter's own
        reply although frames wait behind it. The descriptor knows better.
        """
        if self._reads_ahead and self._bus.has_waiting:  # type: ignore[attr-defined]
            return False
        return self._descriptor is not None and not select.select([self._descriptor], (), (), 0)[0]


def _descriptor(bus: Bus) -> int | None:
    try:
        descriptor = int(bus.fileno())  # type: ignore[attr-defined]
    except (AttributeError, NotImplementedError):
        return None
    return descriptor if descriptor >= 0 else None


def _busy(why: str) -> LinkBusyError:
    return LinkBusyError(f"The CAN bus took no frame in time ({why}); check the wiring and that the robot is on.")
