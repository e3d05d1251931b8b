"""For a controller in another process: send base commands to the runtime on this host."""

import socket
from pathlib import Path

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.base_command import STOP_TEXT, velocity_text

# A queue that is full is read within a tick or two by a runtime that lives.
_PATIENCE_S = 2.0


class BaseCommandClient:
    """Sends to the socket, or to the UDP port, that [source] of the robot's configuration names."""

    def __init__(self, source: int | str | Path) -> None:
        self._by_port = isinstance(source, int)
        self._address = ("127.0.0.1", source) if isinstance(source, int) else str(source)
        self._socket = socket.socket(socket.AF_INET if self._by_port else socket.AF_UNIX, socket.SOCK_DGRAM)

    def send(self, velocity: BodyVelocity) -> bool:
        """Send one base velocity, at the control rate; false when the socket took it not, which a port never tells.

        Raises MtmError when the velocity is not finite.
        """
        text = velocity_text(velocity)
        self._socket.setblocking(False)
        try:
            self._socket.sendto(text, self._address)
        except OSError:
            # Nobody listens, or the queue is full; a runtime that is started anew is sent the next one.
            return False
        return True

    def stop(self) -> None:
        """Send the operator's stop, which holds until the runtime is started anew; waits for room in the queue.

        Raises MtmError when nobody takes it.
        """
        self._socket.settimeout(_PATIENCE_S)
        try:
            self._socket.sendto(STOP_TEXT, self._address)
        except OSError as error:
            reason = error.strerror or error
            raise MtmError(f"no run took the stop at {self._address} ({reason}); stop the robot by hand") from error

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()
