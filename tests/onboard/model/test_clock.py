import signal
import sys
import time

import pytest

from mtm_onboard.model.clock import SystemClock


def test_the_clock_never_runs_backwards():
    clock = SystemClock()
    before_s = clock.now()
    clock.sleep_until(before_s + 0.01)
    after_s = clock.now()
    assert after_s >= before_s + 0.01
    clock.sleep_until(before_s)
    assert clock.now() >= after_s


def test_a_step_of_the_system_s_time_does_not_touch_the_clock(monkeypatch):
    before_s = SystemClock().now()
    monkeypatch.setattr(time, "time", lambda: 0.0)
    assert before_s <= SystemClock().now() < before_s + 60.0


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no CLOCK_BOOTTIME")
def test_the_sleep_of_a_suspended_host_counts():
    assert SystemClock().now() == pytest.approx(time.clock_gettime(time.CLOCK_BOOTTIME), abs=1.0)


def test_a_signal_is_handled_at_once_and_ends_no_wait():
    clock = SystemClock()
    deadline_s = clock.now() + 0.05
    handled_s = []
    former = signal.signal(signal.SIGALRM, lambda *_: handled_s.append(clock.now()))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.005)
        clock.sleep_until(deadline_s)
    finally:
        signal.signal(signal.SIGALRM, former)
    assert clock.now() >= deadline_s
    assert len(handled_s) == 1


def test_a_host_without_an_absolute_wait_waits_for_what_remains(monkeypatch):
    clock = SystemClock()
    for call in (None, lambda *_: 22):
        monkeypatch.setattr("mtm_onboard.model.clock._CLOCK_NANOSLEEP", call)
        deadline_s = clock.now() + 0.005
        clock.sleep_until(deadline_s)
        assert clock.now() >= deadline_s


def test_the_wait_is_for_the_instant_and_not_for_a_span(monkeypatch):
    monkeypatch.setattr(time, "sleep", lambda _: pytest.fail("waited for a span"))
    clock = SystemClock()
    deadline_s = clock.now() + 0.005
    clock.sleep_until(deadline_s)
    assert clock.now() >= deadline_s
