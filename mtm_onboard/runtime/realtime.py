"""The loop's thread made a real-time one: before other programs, on a processor of its own, with its memory at hand."""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from mtm_onboard.runtime.config import RealtimeSettings

# From <sys/mman.h> of Linux.
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4


@contextmanager
def realtime(settings: RealtimeSettings, warn: Callable[[str], None]) -> Iterator[None]:
    """Have the calling thread run as `settings` ask, and as before after the block; locked memory is the process's.

    What the system refuses is left as it was, and `warn` is told once, in a sentence that says what to do about it.
    """
    refused: list[str] = []
    with ExitStack() as undo:
        for apply in (_lock_memory, _pin, _schedule):
            try:
                apply(settings, undo)
            except OSError as error:
                refused.append(_REMEDIES[apply].format(settings=settings, reason=error.strerror))
            except AttributeError:
                refused.append(f"this system has no {_NAMES[apply]}, so leave it out")
        if refused:
            warn(f"[realtime] is not wholly in force: {'; '.join(refused)}")
        yield


def _schedule(settings: RealtimeSettings, undo: ExitStack) -> None:
    if settings.priority is None:
        return
    # Zero is the calling thread, not the process.
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(settings.priority))
    undo.callback(os.sched_setscheduler, 0, policy, parameters)


def _pin(settings: RealtimeSettings, undo: ExitStack) -> None:
    if settings.cpu is None:
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {settings.cpu})
    undo.callback(os.sched_setaffinity, 0, before)


def _lock_memory(settings: RealtimeSettings, undo: ExitStack) -> None:
    if not settings.lock_memory:
        return
    libc = ctypes.CDLL(None, use_errno=True)
    # Each page once it is touched, as the loop's are in its first ticks: all at once would fill stacks and libraries.
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    undo.callback(libc.munlockall)


_NAMES = {_schedule: "SCHED_FIFO", _pin: "choice of processors", _lock_memory: "mlockall"}
_REMEDIES = {
    _schedule: (
        "priority {settings.priority} is refused ({reason}), so give the service LimitRTPRIO={settings.priority} or "
        "more, or the user an rtprio limit in /etc/security/limits.conf"
    ),
    _pin: "cpu {settings.cpu} is refused ({reason}), so choose a processor that this computer lets the program use",
    _lock_memory: (
        "memory cannot be locked ({reason}), so give the service LimitMEMLOCK=infinity, or the user an unlimited "
        "memlock in /etc/security/limits.conf"
    ),
}
