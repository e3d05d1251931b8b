"""Time of one tick on the robot; `make bench` shows it."""

import time
import tracemalloc
from collections.abc import Callable
from itertools import count

import numpy as np
import pytest

from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, Scheme
from mtm_onboard.runtime.guard import Guard, Limits, Staleness
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime

BASE = BodyVelocity(0.3, 0.1, 0.2)


def modulator(schedule: str) -> Modulator:
    scheme = Scheme(
        name="test", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=600,
        channels=(Channel("a", "a", ("vx", "vy"), 1, 0.1),), schedule=schedule,
    )  # fmt: skip
    return Modulator(Codebook(b"not a real secret, only for test", scheme), "a", (2,))


def guard() -> Guard:
    return Guard(Limits(1.0, 2.0), Staleness(), noise_sigma=0.1, period_s=0.02)


def modulated_and_guarded(schedule: str) -> Callable[[], BodyVelocity]:
    """The next tick of a modulator and a guard, each time it is called."""
    plays, checks, ticks = modulator(schedule), guard(), count()

    def tick() -> BodyVelocity:
        number = next(ticks)
        now_s = number / 50.0
        base = checks.admit(BASE, now_s, now_s)
        sent = checks.limit(base, plays.add(number, base))
        plays.prepare(number)
        return sent

    return tick


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_modulator_and_guard_take_a_few_microseconds_a_tick(benchmark, schedule):
    assert benchmark(modulated_and_guarded(schedule)) != BASE


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_modulator_and_guard_take_20_microseconds_at_most(capsys, schedule):
    tick = modulated_and_guarded(schedule)
    times_ns = np.empty(10_000)
    for number in range(len(times_ns)):
        begun_ns = time.thread_time_ns()
        tick()
        times_ns[number] = time.thread_time_ns() - begun_ns
    with capsys.disabled():
        print(
            f"\nmodulator and guard, {schedule} schedule: {1e-3 * np.median(times_ns):.1f} us a tick in the middle, "
            f"{1e-3 * np.quantile(times_ns, 0.99):.1f} us p99 of {len(times_ns)}"
        )
    assert np.median(times_ns) <= 20_000


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_ten_thousand_ticks_leave_no_memory_taken(capsys, schedule):
    tick = modulated_and_guarded(schedule)
    # Two messages, after which whatever is kept has been kept once.
    for _ in range(1200):
        tick()
    tracemalloc.start()
    try:
        for _ in range(1200):
            tick()
        before_bytes, _ = tracemalloc.get_traced_memory()
        for _ in range(10_000):
            tick()
        grown_bytes = tracemalloc.get_traced_memory()[0] - before_bytes
    finally:
        tracemalloc.stop()
    with capsys.disabled():
        print(f"\nmodulator and guard, {schedule} schedule: {grown_bytes} bytes more after 10,000 ticks")
    # What is reused settles within a few thousand; a single float a tick would be 240,000.
    assert grown_bytes < 8000


def test_a_whole_tick_on_a_trivial_link_takes_a_few_microseconds(benchmark):
    source, link, ticks = HeldSource(), NullLink(), count()
    runtime = Runtime(modulator("fixed"), guard(), source, link)

    def tick() -> None:
        number = next(ticks)
        source.set(BASE, number / 50.0)
        runtime.step(number, number / 50.0)

    benchmark(tick)
    assert link.sent > 0
