"""The time of day, which the rolling schedule follows, and whether the kernel vouches for it."""

import ctypes
import time
from typing import Protocol

from mtm_onboard.model.clock import Clock

# From <sys/timex.h>.
_STA_UNSYNC = 0x0040


class WallClock(Protocol):
    """Seconds since the Unix epoch as this computer has them; they may be set, and so jump either way."""

    def unix_s(self) -> float:
        """Seconds since the Unix epoch."""
        ...

    def is_synchronised(self) -> bool | None:
        """Whether somebody keeps the clock right; None when nobody says."""
        ...


class SystemWallClock:
    """The time of day that this computer has."""

    def unix_s(self) -> float:
        """Seconds of CLOCK_REALTIME."""
        return time.time()

    def is_synchronised(self) -> bool | None:
        """The kernel's word: it is, from what an NTP client tells it, until nobody has for hours or the time is set."""
        return is_synchronised()


class SimulatedWallClock:
    """The time of day of a simulation, which nobody sets."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def unix_s(self) -> float:
        """The simulation's own time."""
        return self._clock.now()

    def is_synchronised(self) -> bool:
        """There is only one clock."""
        return True


class _Timex(ctypes.Structure):
    """The beginning of the kernel's `struct timex`; the rest is room."""

    _fields_ = (
        ("modes", ctypes.c_uint), ("offset", ctypes.c_long), ("freq", ctypes.c_long), ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long), ("status", ctypes.c_int), ("rest", ctypes.c_char * 512),
    )  # fmt: skip


def is_synchronised() -> bool | None:
    """Whether the kernel reports the clock as synchronised; None when it does not say."""
    state = _Timex()
    try:
        answer = ctypes.CDLL(None).adjtimex(ctypes.byref(state))
    except AttributeError:
        return None
    return None if answer < 0 else not state.status & _STA_UNSYNC
