"""An interrupt while a program loads its modules: one sentence, and no traceback out of the middle of an import."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interruptible_loading(program: str) -> Iterator[None]:
    """While the block imports, an interrupt ends the process with 130; nothing may have been written before."""
    former = signal.getsignal(signal.SIGINT)

    def leave(*_: object) -> None:
        # An exception could come out of a half-loaded module as another one.
        os.write(2, f"{program}: interrupted; nothing was written\n".encode())
        os._exit(130)

    # Whoever started this with interrupts ignored, as a shell does in the background, wants them ignored.
    if former is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
