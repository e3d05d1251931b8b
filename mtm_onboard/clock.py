"""Time, as the loop sees it: the system's monotonic clock on the robot, simulated time in the rig."""

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds from an arbitrary origin that never run backwards, and a way to wait for one of them."""

    def now(self) -> float:
        """Seconds since the clock's origin."""
        ...

    def sleep_until(self, deadline_s: float) -> None:
        """Return at or as soon as possible after `deadline_s`; at once when it has passed."""
        ...


class SystemClock:
    """The monotonic clock of this host."""

    def now(self) -> float:
        """Seconds of CLOCK_MONOTONIC."""
        return time.monotonic()

    def sleep_until(self, deadline_s: float) -> None:
        """Sleep for what remains; signals do not end it early."""
        remaining_s = deadline_s - time.monotonic()
        if remaining_s > 0:
            time.sleep(remaining_s)
