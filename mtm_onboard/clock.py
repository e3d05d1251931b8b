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


# Linux stops CLOCK_MONOTONIC while the host is suspended, and a base command from before would be young after it.
_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


class SystemClock:
    """The clock of this host that steps of the system's time do not touch, and that a suspended host's sleep does."""

    def now(self) -> float:
        """Seconds of CLOCK_BOOTTIME, where there is one, else of CLOCK_MONOTONIC."""
        return time.clock_gettime(_CLOCK)

    def sleep_until(self, deadline_s: float) -> None:
        """Sleep for what remains; signals do not end it early."""
        remaining_s = deadline_s - self.now()
        if remaining_s > 0:
            time.sleep(remaining_s)
