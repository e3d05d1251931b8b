"""The thread that does what a link needs between commands, such as heartbeats."""

import math
import threading
from types import TracebackType
from typing import Self

from mtm_onboard.links.base import Link
from mtm_onboard.model.clock import Clock

# Above the longest that opening or stopping a link takes.
_LONGEST_FAREWELL_S = 5.0


class ServiceThread:
    """Calls `link.service` each `service_period_s` while its block runs; the first failure ends it.

    Periods are counted from the first call, so that no call's length makes the next ones late; what a long call has
    missed is skipped. `error` holds that failure, and whoever runs the loop stops the robot for it. A call that never
    returns, such as a write to a wedged driver, is left behind when the block ends.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self.error: BaseException | None = None
        self._link = link
        self._clock = clock
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="service", daemon=True)

    @property
    def thread(self) -> threading.Thread:
        """The thread itself, to which a run gives its place among others."""
        return self._thread

    def _run(self) -> None:
        clock, link = self._clock, self._link
        next_s = clock.now()
        try:
            while not self._ending.is_set():
                link.service(clock.now())
                period_s, now_s = link.service_period_s, clock.now()
                next_s += period_s * max(1, math.ceil((now_s - next_s) / period_s))
                self._ending.wait(next_s - now_s)
        except BaseException as error:
            # Whatever ends this thread, nobody serves the link any more.
            self.error = error

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join(_LONGEST_FAREWELL_S)
