"""A transport without a wire: commands reach the motion controller rounded as a CAN message rounds them."""

from hil.vehicles.motion_controller import MotionController
from mtm_onboard.links.base import Link
from mtm_onboard.links.robomaster_messages import speed_payload, speed_velocity
from mtm_onboard.model.clock import Clock
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError


class DirectLink(Link):
    """Hands each command to `controller` after the 32-bit round trip of a RoboMaster speed message.

    The motion is the same bit for bit as over the simulated CAN bus with the controller advanced at the same instants.
    `clock` says when a command arrives; the deadman counts from there, over the bus from the poll that reads it. Use it
    from one thread.
    """

    def __init__(self, controller: MotionController, clock: Clock) -> None:
        self._controller = controller
        self._clock = clock
        self._is_open = False

    def open(self) -> None:
        """Switch the work mode on."""
        self._controller.set_work_mode(True)
        self._is_open = True

    def send(self, velocity: BodyVelocity) -> None:
        """Hand over one command; raises ValueError for non-finite values and MtmError when the link is not open."""
        payload = speed_payload(velocity)
        if not self._is_open:
            raise MtmError("The link to the robot is not open; open it before sending.")
        self._controller.command_speed(self._clock.now(), *speed_velocity(payload))

    def stop(self) -> None:
        """Switch the work mode off, which demands a standstill; sending needs `open` again."""
        self._is_open = False
        self._controller.set_work_mode(False)

    def close(self) -> None:
        """There is nothing to release."""
