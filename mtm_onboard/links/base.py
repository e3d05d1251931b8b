"""The seam between the runtime and a robot: one body velocity out, and always a stop at the end."""

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError


class LinkBusyError(MtmError):
    """The far end took a command not at all, or not whole, within the write bound; the link may still be sound.

    `has_begun` says of a command in a stream that its first bytes have left and the others will, before the next one.
    """

    has_begun: bool = False


class TakenOverError(MtmError):
    """Somebody else, such as a pilot, has taken the robot over; whoever meets this must not open the link anew."""


class Link(ABC):
    """A link to one robot. As a context manager it opens the link, and leaving it always sends stop and closes.

    A subclass implements `open`, `send`, `stop` and `close`. `send` refuses non-finite velocities with ValueError
    before anything is packed. `service` does what the link needs between commands (heartbeats, telemetry); the
    runtime calls it at least every `service_period_s`, on the robot from a thread of its own, so a subclass guards
    whole messages with a lock. `write_bound_s` is the longest that `send` may wait for the far end. `has_deadman` says
    whether the robot stops by itself when no commands come; one that does not goes on until the link is back.

    A link that has reason to doubt that it is obeyed says why in `degraded`, which is empty otherwise; one that knows
    it is not raises from `send`. Opening it anew is not its own affair, see `reconnecting`.
    """

    service_period_s: float = 0.010
    write_bound_s: float = 0.005
    has_deadman: bool = True
    degraded: str = ""

    @abstractmethod
    def open(self) -> None:
        """Bring the link up and make the robot ready to move; raises MtmError when that fails."""

    def resume(self) -> None:
        """Open the link again after it was lost.

        As `open`, except that a robot which was switched over in the meantime, by whomever, is left as it is.
        """
        self.open()

    @abstractmethod
    def send(self, velocity: BodyVelocity) -> None:
        """Send one command; raises ValueError for non-finite values and MtmError when the link is down."""

    @abstractmethod
    def stop(self) -> None:
        """Send what makes the robot stand still; safe to call more than once."""

    @abstractmethod
    def close(self) -> None:
        """Release the link; safe to call more than once."""

    def service(self, now_s: float) -> None:  # noqa: B027 - most links need nothing between commands
        """Do what is due at `now_s` (seconds of the runtime's clock)."""

    def counters(self) -> dict[str, int]:
        """What was counted since the link was made, by name, for reports; empty when it counts nothing."""
        return {}

    def health(self) -> dict[str, int | float | str | bool]:
        """The counters and, beside them, states of the link by name, for reports."""
        return {**self.counters()}

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        finally:
            self.close()
