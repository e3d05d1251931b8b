"""The fixed-rate loop: absolute deadlines, tick numbers from elapsed time, lateness in fixed memory."""

import math
from collections.abc import Callable

from mtm_onboard.model.clock import Clock
from mtm_onboard.protocol.errors import MtmError

_BINS_PER_DECADE = 20
_SHORTEST_S = 1e-6
_DECADES = 7
# Clocks of finite resolution and sums of floats stand a hair before a deadline they have reached, in ticks.
_HAIR = 1e-4


class Lateness:
    """A histogram of delays from one microsecond to ten seconds, twenty bins a decade; it never grows."""

    def __init__(self) -> None:
        self._counts = [0] * (_DECADES * _BINS_PER_DECADE + 1)
        self.worst_s = 0.0

    def record(self, delay_s: float) -> None:
        """Count one delay; what is below a microsecond counts as one."""
        if delay_s > self.worst_s:
            self.worst_s = delay_s
        place = 0 if delay_s <= _SHORTEST_S else math.ceil(math.log10(delay_s / _SHORTEST_S) * _BINS_PER_DECADE)
        self._counts[min(place, len(self._counts) - 1)] += 1

    def quantile_s(self, part: float) -> float:
        """The delay that `part` (0 to 1) of all stayed within, rounded up to its bin's edge; 0 before any."""
        wanted = part * sum(self._counts)
        seen = 0
        for place, count in enumerate(self._counts):
            seen += count
            if seen >= wanted and seen:
                return min(self.worst_s, _SHORTEST_S * 10 ** (place / _BINS_PER_DECADE))
        return 0.0


class LoopStats:
    """What became of each tick that was due: `sent`, `unsent` or `missed`; and how late the loop was.

    In a tick that was sent the command left for the robot, in an unsent one the loop ran and the command did not leave,
    and in a missed one the loop came too late to run. `overruns` counts steps that took over a period. `lateness` is
    from the instant that the loop waited for to its wake-up, so one that has missed ticks is over a period.
    """

    def __init__(self) -> None:
        self.sent = 0
        self.unsent = 0
        self.missed = 0
        self.overruns = 0
        self.lateness = Lateness()


def run_loop(
    clock: Clock,
    rate_hz: float,
    step: Callable[[int, float, float], bool | None],
    *,
    start_s: float,
    stop: Callable[[], bool],
    stats: LoopStats | None = None,
) -> LoopStats:
    """Call `step(tick, now_s, late_s)` at start_s + tick / rate_hz until `stop()` is true, from the next tick on.

    Ticks before `start_s` are negative. The number comes from elapsed time: a wake-up that is late by whole
    periods skips their ticks and counts them as missed, and no tick comes twice or in a burst. `late_s` is the time
    since the instant that was awaited, with what was skipped. A step that raises, or returns False, has sent nothing.
    `stop` is asked before each tick. `stats`, when given, is filled as the loop runs, so that it outlives an exception.
    Raises MtmError when the rate is not above zero.
    """
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise MtmError(f"the loop's rate is {rate_hz} Hz; give a number above zero")
    stats = LoopStats() if stats is None else stats
    awaited = math.ceil((clock.now() - start_s) * rate_hz - _HAIR)
    while True:
        deadline_s = start_s + awaited / rate_hz
        clock.sleep_until(deadline_s)
        if stop():
            return stats
        now_s = clock.now()
        tick = max(awaited, math.floor((now_s - start_s) * rate_hz + _HAIR))
        late_s = now_s - deadline_s
        stats.lateness.record(late_s)
        stats.missed += tick - awaited
        has_sent = False
        try:
            has_sent = step(tick, now_s, late_s) is not False
        finally:
            stats.sent += has_sent
            stats.unsent += not has_sent
        stats.overruns += clock.now() - now_s > 1.0 / rate_hz
        awaited = tick + 1
