"""The link to a robot that takes twists from a topic."""

from collections.abc import Callable
from typing import Any

from mtm_onboard.links.base import Link
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.ros.twist import set_velocity


class TwistLink(Link):
    """Publishes each command as a twist; `make` gives a twist whose components are zero."""

    def __init__(self, make: Callable[[], Any], publish: Callable[[Any], None]) -> None:
        self._make = make
        self._publish = publish
        self._open = self._drives = False

    def open(self) -> None:
        """Nothing to bring up: the topic is there as long as the node is."""
        self._open = self._drives = True

    def send(self, velocity: BodyVelocity) -> None:
        """Publish one command; raises ValueError when it is not finite and MtmError when the link is not open."""
        if not self._drives:
            raise MtmError("the link to the topic is not open; open it before sending")
        if not velocity.is_finite():
            raise ValueError(f"{velocity} is not finite")
        self._put(velocity)

    def stop(self) -> None:
        """Publish a twist of zeros."""
        self._drives = False
        if self._open:
            self._put(STOP)

    def close(self) -> None:
        """Publish no more; the topic itself is the node's."""
        self._open = self._drives = False

    def _put(self, velocity: BodyVelocity) -> None:
        twist = self._make()
        set_velocity(twist, velocity)
        self._publish(twist)
