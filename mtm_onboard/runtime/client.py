"""For a controller in another process: send base commands to the runtime's UDP port."""

import socket

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.runtime.base_command import STOP_TEXT, velocity_text


class BaseCommandClient:
    """Sends to the runtime on this host; nothing tells whether it listens, so send at the control rate."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._address = ("127.0.0.1", port)

    def send(self, velocity: BodyVelocity) -> None:
        """Send one base velocity; raises MtmError when it is not finite."""
        self._socket.sendto(velocity_text(velocity), self._address)

    def stop(self) -> None:
        """Send the operator's stop, which holds until the runtime is started anew."""
        self._socket.sendto(STOP_TEXT, self._address)

    def close(self) -> None:
        """Release the socket."""
        self._socket.close()
