"""A robot's runtime in simulated time, whose base commands come from the test."""

from collections.abc import Callable

from hil.fleet.clock import SimulatedClock
from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.base import Link
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.runtime.guard import Guard, Limits, Staleness
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.source import HeldSource, Source
from mtm_onboard.runtime.tick import NoiseAdder, Runtime

RATE_HZ = 50.0


class Driven:
    """`transport` is open and served on `clock`; tick 0 was at the clock's start.

    Base commands come from `source` when it is given, else from what `run` is told.
    """

    def __init__(
        self,
        transport: Link,
        clock: SimulatedClock,
        modulator: NoiseAdder | None = None,
        limits: Limits | None = None,
        staleness: Staleness | None = None,
        journal: Journal | None = None,
        source: Source | None = None,
    ) -> None:
        self.clock = clock
        self.source = HeldSource()
        limits, staleness = limits or Limits(1.0, 2.0), staleness or Staleness()
        self.guard = Guard(limits, staleness, noise_sigma=0.1, period_s=1.0 / RATE_HZ)
        self.stats = LoopStats()
        self._runtime = Runtime(modulator, self.guard, source or self.source, transport, journal)

    def run(self, seconds: float, base: BodyVelocity | None = None, stop: Callable[[], bool] = lambda: False) -> None:
        """Tick for so long, with a fresh base command in each tick, or none."""
        end_s = self.clock.now() + seconds - 1e-9

        def step(tick: int, now_s: float, late_s: float) -> bool:
            if base is not None:
                self.source.set(base, now_s)
            return self._runtime.step(tick, now_s, late_s)

        run_loop(
            self.clock, RATE_HZ, step, start_s=0.0, stop=lambda: stop() or self.clock.now() >= end_s, stats=self.stats
        )
