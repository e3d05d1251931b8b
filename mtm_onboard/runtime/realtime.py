"""The threads of a run made real-time ones: before other programs, in their order, with their memory at hand."""

import ctypes
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress

from mtm_onboard.runtime.config import RealtimeSettings

# From <sys/mman.h> of Linux.
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
# How long a thread that computes may keep the interpreter from the loop; ten times less than usual.
_SWITCH_INTERVAL_S = 0.0005


@contextmanager
def realtime(
    settings: RealtimeSettings, warn: Callable[[str], None]
) -> Iterator[Callable[[threading.Thread | None], None]]:
    """Have the calling thread run as `settings` ask, and as before after the block; locked memory is the process's.

    The block is given a function that puts the process's other threads in their places, to be called when they have
    begun: the thread it is given, which serves the link, runs one priority below the calling one and all others two
    below, but not under 1. One that stayed below other programs would be made to wait by them while it holds a lock, or
    the interpreter, that the loop is waiting for. The choice of a processor is the calling thread's alone.

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
        is_placed = settings.priority is not None and not any("priority" in text for text in refused)
        own = threading.current_thread()

        def place(heartbeat: threading.Thread | None) -> None:
            for thread in threading.enumerate() if is_placed else ():
                if thread is not own and thread.native_id is not None:
                    below = 1 if thread is heartbeat else 2
                    with suppress(ProcessLookupError):  # it has just ended
                        _place(thread.native_id, max(1, (settings.priority or 0) - below), undo)

        yield place


def _schedule(settings: RealtimeSettings, undo: ExitStack) -> None:
    if settings.priority is None:
        return
    _place(0, settings.priority, undo)  # zero is the calling thread, not the process
    undo.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(_SWITCH_INTERVAL_S)


def _place(thread: int, priority: int, undo: ExitStack) -> None:
    policy, parameters = os.sched_getscheduler(thread), os.sched_getparam(thread)
    os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))

    def take_back() -> None:
        with suppress(ProcessLookupError):
            os.sched_setscheduler(thread, policy, parameters)

    undo.callback(take_back)


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
