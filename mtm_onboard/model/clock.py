"""Time, as the loop sees it: the system's monotonic clock on the robot, simulated time in the rig."""

import ctypes
import errno
import math
import time
from typing import Any, Protocol


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
_TIMER_ABSTIME = 1
# None where the C library has no such call.
_CLOCK_NANOSLEEP: Any = getattr(ctypes.CDLL(None), "clock_nanosleep", None)


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class SystemClock:
    """The clock of this host that steps of the system's time do not touch, and that a suspended host's sleep does."""

    def now(self) -> float:
        """Seconds of CLOCK_BOOTTIME, where there is one, else of CLOCK_MONOTONIC."""
        return time.clock_gettime(_CLOCK)

    def sleep_until(self, deadline_s: float) -> None:
        """Wait for the instant itself; signals do not end it early.

        `time.sleep` waits for what remains, and a thread that loses its processor after reckoning that, before it
        sleeps, would wake so much later.
        """
        if self.now() >= deadline_s:
            return
        answer = None if _CLOCK_NANOSLEEP is None else errno.EINTR
        instant = _Timespec(*divmod(math.ceil(deadline_s * 1e9), 10**9))
        while answer == errno.EINTR:
            answer = _CLOCK_NANOSLEEP(_CLOCK, _TIMER_ABSTIME, ctypes.byref(instant), None)
        if answer != 0:
            # There is no such call, or it knows no such wait on this clock.
            time.sleep(max(0.0, deadline_s - self.now()))
