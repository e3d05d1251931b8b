"""The thread that takes in a node's messages and service calls."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

_LONGEST_FAREWELL_S = 2.0


class Spinning:
    """Calls `spin_once`, which waits a moment for something to do, while its block runs; a failure ends it.

    `error` holds that failure, and whoever runs the loop stops the robot for it: nobody would hear a stop any more.
    """

    def __init__(self, spin_once: Callable[[], None]) -> None:
        self.error: BaseException | None = None
        self._spin_once = spin_once
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ros", daemon=True)

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                self._spin_once()
        except BaseException as error:
            self.error = error

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join(_LONGEST_FAREWELL_S)
