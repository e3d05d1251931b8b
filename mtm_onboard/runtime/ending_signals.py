"""The signals that ask a process to end, taken as a question to ask between ticks."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def ending_signals() -> Iterator[Callable[[], bool]]:
    """Yield a question that is true once the process was asked to end; the former handlers come back after it."""
    asked = False

    def ask(*_: object) -> None:
        nonlocal asked
        asked = True

    former = {number: signal.signal(number, ask) for number in _SIGNALS}
    try:
        yield lambda: asked
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
