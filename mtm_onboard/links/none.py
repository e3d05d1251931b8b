"""A link to no robot, for dry runs."""

from mtm_onboard.links.base import Link
from mtm_onboard.model.velocity import BodyVelocity


class NullLink(Link):
    """Counts the commands `sent` and the `stops`, and does nothing else."""

    def __init__(self) -> None:
        self.sent = 0
        self.stops = 0

    def open(self) -> None:
        """Nothing to bring up."""

    def send(self, velocity: BodyVelocity) -> None:
        """Count one command; raises ValueError when it is not finite."""
        if not velocity.is_finite():
            raise ValueError(f"{velocity} is not finite")
        self.sent += 1

    def stop(self) -> None:
        """Count one stop."""
        self.stops += 1

    def close(self) -> None:
        """Nothing to release."""
