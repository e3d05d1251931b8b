"""Simulated time: a clock that runs the callbacks that are due while a caller sleeps."""

import heapq
from collections.abc import Callable

_MICRO = 1_000_000


class SimulatedClock:
    """A `mtm_onboard.model.clock.Clock` whose time moves only inside `sleep_until`, through the due callbacks in order.

    Instants are whole microseconds, so periods never drift. Callbacks due at the same instant run in the order in
    which they were registered.
    """

    def __init__(self) -> None:
        self._now_us = 0
        self._order = 0
        self._due: list[tuple[int, int, int, Callable[[float], None]]] = []

    def now(self) -> float:
        """Simulated seconds since the start."""
        return self._now_us / _MICRO

    def every(self, period_s: float, callback: Callable[[float], None], first_s: float = 0.0) -> None:
        """Call `callback(now_s)` at `first_s` and each `period_s` after it."""
        period_us = round(period_s * _MICRO)
        if period_us < 1:
            raise ValueError(f"a period of {period_s} s is below one microsecond")
        heapq.heappush(self._due, (round(first_s * _MICRO), self._order, period_us, callback))
        self._order += 1

    def sleep_until(self, deadline_s: float) -> None:
        """Run every callback due before or at the deadline, then stand at the deadline."""
        deadline_us = round(deadline_s * _MICRO)
        due = self._due
        while due and due[0][0] <= deadline_us:
            at_us, order, period_us, callback = due[0]
            self._now_us = max(self._now_us, at_us)
            heapq.heapreplace(due, (at_us + period_us, order, period_us, callback))
            callback(self._now_us / _MICRO)
        self._now_us = max(self._now_us, deadline_us)


class AnsweringClock:
    """A clock for a link that is opened before the run begins: whoever waits on it is answered, and no time passes."""

    def __init__(self, clock: SimulatedClock, answer: Callable[[float], None]) -> None:
        self._clock = clock
        self._answer = answer

    def now(self) -> float:
        """The other clock's time."""
        return self._clock.now()

    def sleep_until(self, deadline_s: float) -> None:
        """Have the far end do what is due."""
        self._answer(self._clock.now())
