import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.fleet.clock import SimulatedClock
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.loop import Lateness, LoopStats, run_loop


class SlowClock(SimulatedClock):
    """Wakes later than asked by each of `delays_s` in turn, and then on time."""

    def __init__(self, delays_s=()) -> None:
        super().__init__()
        self._delays_s = list(delays_s)

    def sleep_until(self, deadline_s: float) -> None:
        super().sleep_until(max(deadline_s, self.now()) + (self._delays_s.pop(0) if self._delays_s else 0.0))


def run(clock, until_s: float, *, rate_hz: float = 50.0, start_s: float = 0.0):
    calls: list[tuple[int, float]] = []
    stats = run_loop(
        clock, rate_hz, lambda tick, now_s, _late_s: calls.append((tick, now_s)), start_s=start_s,
        stop=lambda: clock.now() >= until_s - 1e-9,
    )  # fmt: skip
    return calls, stats


@pytest.mark.parametrize("rate_hz", [10.0, 30.0, 50.0, 59.94, 1000.0])
def test_every_tick_comes_once_and_on_its_deadline(rate_hz):
    calls, stats = run(SimulatedClock(), 99.5 / rate_hz, rate_hz=rate_hz)
    assert [tick for tick, _ in calls] == list(range(100))
    assert all(abs(now_s - tick / rate_hz) < 1e-6 for tick, now_s in calls)
    assert (stats.sent, stats.missed) == (100, 0)


def test_ticks_before_the_start_are_negative():
    calls, _ = run(SimulatedClock(), 0.2, start_s=0.1)
    assert [tick for tick, _ in calls] == list(range(-5, 5))


def test_a_loop_begun_late_joins_at_the_next_tick():
    clock = SimulatedClock()
    clock.sleep_until(0.25)
    calls, stats = run(clock, 0.36)
    assert calls == [(13, 0.26), (14, 0.28), (15, 0.30), (16, 0.32), (17, 0.34)]
    assert stats.missed == 0


def test_ticks_slept_through_are_never_caught_up():
    calls, stats = run(SlowClock([0, 0, 0.05]), 0.2)
    assert [tick for tick, _ in calls] == [0, 1, 4, 5, 6, 7, 8, 9]
    assert (stats.sent, stats.missed) == (8, 2)
    assert stats.lateness.worst_s == pytest.approx(0.05)


def test_a_step_is_told_how_late_it_is_with_the_ticks_it_missed():
    clock, lates_s = SlowClock([0, 0, 0.137, 0.003]), []
    stats = run_loop(
        clock, 50.0, lambda tick, now_s, late_s: lates_s.append(late_s), start_s=0.0, stop=lambda: clock.now() >= 0.3
    )
    assert lates_s[:5] == pytest.approx([0.0, 0.0, 0.137, 0.003, 0.0], abs=1e-6)
    assert (stats.missed, stats.lateness.worst_s) == (6, pytest.approx(0.137))


def test_a_step_that_sent_nothing_is_counted_as_unsent():
    clock = SimulatedClock()
    stats = run_loop(
        clock, 50.0, lambda tick, now_s, late_s: tick % 5 != 0, start_s=0.0, stop=lambda: clock.now() >= 1.99
    )
    assert (stats.sent, stats.unsent, stats.missed) == (80, 20, 0)


def test_a_step_of_three_periods_costs_the_ticks_between():
    clock = SimulatedClock()
    ticks = []

    def step(tick: int, now_s: float, _late_s: float) -> None:
        ticks.append(tick)
        clock.sleep_until(now_s + (0.061 if tick == 2 else 0.0))

    stats = run_loop(clock, 50.0, step, start_s=0.0, stop=lambda: clock.now() >= 0.1999)
    assert ticks == [0, 1, 2, 5, 6, 7, 8, 9]
    assert stats.missed == 2


@given(st.lists(st.floats(0, 0.1), max_size=30), st.sampled_from([10.0, 30.0, 50.0]))
def test_however_late_the_wake_ups_no_tick_comes_twice_or_early(delays_s, rate_hz):
    calls, stats = run(SlowClock(delays_s), 4.0, rate_hz=rate_hz)
    ticks = [tick for tick, _ in calls]
    assert all(earlier < later for earlier, later in pairwise(ticks))
    assert all(-1e-5 <= now_s - tick / rate_hz < 1 / rate_hz + 1e-5 for tick, now_s in calls)
    assert stats.sent + stats.missed == ticks[-1] + 1


def test_steps_that_take_longer_than_a_period_are_counted():
    clock = SimulatedClock()

    def step(tick: int, now_s: float, _late_s: float) -> None:
        clock.sleep_until(now_s + (0.05 if tick % 10 == 4 else 0.01))

    stats = run_loop(clock, 50.0, step, start_s=0.0, stop=lambda: clock.now() >= 1.99)
    assert (stats.overruns, stats.missed) == (10, 10)


def test_stop_is_asked_before_each_tick():
    stats = LoopStats()

    def step(tick: int, *_: float) -> None:
        if tick == 3:
            raise MtmError("the link is down; check it")

    with pytest.raises(MtmError, match="link"):
        run_loop(SimulatedClock(), 50.0, step, start_s=0.0, stop=lambda: False, stats=stats)
    assert (stats.sent, stats.unsent) == (3, 1)
    assert run_loop(SimulatedClock(), 50.0, step, start_s=0.0, stop=lambda: True).sent == 0


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, math.nan, math.inf])
def test_a_rate_that_is_no_rate_is_refused(rate_hz):
    with pytest.raises(MtmError, match="above zero"):
        run(SimulatedClock(), 1.0, rate_hz=rate_hz)


@given(st.lists(st.floats(0, 20), min_size=1), st.floats(0.01, 1))
def test_quantiles_are_right_to_a_bin_of_an_eighth(delays_s, part):
    lateness = Lateness()
    for delay_s in delays_s:
        lateness.record(delay_s)
    exact = sorted(delays_s)[math.ceil(part * len(delays_s) - 1e-9) - 1]
    # Below a microsecond and above ten seconds the outermost bins take all.
    low, high = max(1e-6, min(exact, 10.0)) / 1.0001, max(1e-6, exact) * 10 ** (1 / 20) * 1.0001
    assert min(low, lateness.worst_s) <= lateness.quantile_s(part) <= high


def test_lateness_takes_the_same_memory_after_many_ticks():
    lateness = Lateness()
    size = len(vars(lateness)["_counts"])
    for count in range(10_000):
        lateness.record(count * 1e-3)
    assert len(vars(lateness)["_counts"]) == size
    assert Lateness().quantile_s(0.5) == 0.0


def test_a_quantile_is_the_upper_edge_of_its_bin():
    lateness = Lateness()
    for delay_s in (1e-9, 1e-9, 1e-9, 1.23e-3, 5.0):
        lateness.record(delay_s)
    assert lateness.quantile_s(0.5) == 1e-6
    assert lateness.quantile_s(0.8) == pytest.approx(1e-6 * 10 ** (62 / 20))
    assert lateness.quantile_s(1.0) == 5.0


def test_what_is_later_than_ten_seconds_counts_as_ten():
    lateness = Lateness()
    lateness.record(50.0)
    assert lateness.quantile_s(1.0) == pytest.approx(10.0)
    assert lateness.worst_s == 50.0


def test_a_wake_up_exactly_on_a_later_deadline_is_of_that_tick():
    calls, stats = run(SlowClock([0, 0, 0.04]), 0.15)
    assert [tick for tick, _ in calls] == [0, 1, 4, 5, 6, 7]
    assert stats.missed == 2


def test_a_step_that_takes_exactly_a_period_is_no_overrun():
    clock = SimulatedClock()
    # A sixty-fourth of a second has an exact floating-point number.
    stats = run_loop(
        clock,
        64.0,
        lambda _, now_s, late_s: clock.sleep_until(now_s + 1 / 64),
        start_s=0.0,
        stop=lambda: clock.now() >= 1.0,
    )
    assert (stats.overruns, stats.missed) == (0, 0)


def test_a_loop_may_be_slower_than_one_hertz():
    calls, _ = run(SimulatedClock(), 9.0, rate_hz=0.5)
    assert [tick for tick, _ in calls] == [0, 1, 2, 3, 4]
