"""DJI's messages over a CAN bus, where each CAN id is one stream of bytes."""

from typing import TYPE_CHECKING, Protocol

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.transports.duml import Message, Parser, encode, segment

if TYPE_CHECKING:
    import can

_SEND_TIMEOUT_S = 0.005
_MOST_FRAMES_A_READ = 512  # so that a babbling bus cannot hold its reader for ever


class Bus(Protocol):
    """What is used of a python-can bus."""

    def send(self, msg: "can.Message", timeout: float | None = None) -> None:
        """Put one frame on the bus."""
        ...

    def recv(self, timeout: float | None = None) -> "can.Message | None":
        """The next frame, None when there is none within `timeout` seconds."""
        ...

    def shutdown(self) -> None:
        """Release the bus."""
        ...


class CanStream:
    """Writes messages under one 11-bit id of `bus` and reads those that arrive under another.

    Raises MtmError when python-can is missing. Writing from several threads needs a lock around whole messages.
    """

    def __init__(self, bus: Bus, send_id: int, receive_id: int) -> None:
        try:
            import can
        except ImportError:
            raise MtmError("python-can is not installed; install mtm[can] to reach a robot over CAN.") from None
        self.parser = Parser()
        self._bus = bus
        self._send_id = send_id
        self._receive_id = receive_id
        self._frame = can.Message
        self._errors = (can.CanError, OSError)

    def write(self, message: Message) -> None:
        """Put one message on the bus; raises MtmError when the bus refuses a frame of it."""
        try:
            for data in segment(encode(message)):
                frame = self._frame(arbitration_id=self._send_id, is_extended_id=False, data=data)
                self._bus.send(frame, timeout=_SEND_TIMEOUT_S)
        except self._errors as error:
            raise MtmError(f"The CAN bus refused a frame ({error}); check the wiring and the robot's power.") from error

    def read(self) -> list[Message]:
        """Every message that is complete by now, without waiting; raises MtmError when the bus cannot be read."""
        data = bytearray()
        try:
            for _ in range(_MOST_FRAMES_A_READ):
                frame = self._bus.recv(0)
                if frame is None:
                    break
                if frame.arbitration_id == self._receive_id and not (frame.is_extended_id or frame.is_error_frame):
                    data += frame.data
        except self._errors as error:
            raise MtmError(f"The CAN bus cannot be read ({error}); check the wiring and the robot's power.") from error
        return self.parser.feed(data)

    def shutdown(self) -> None:
        """Release the bus."""
        self._bus.shutdown()
