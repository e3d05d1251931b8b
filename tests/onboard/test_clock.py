import sys
import time

import pytest

from mtm_onboard.clock import SystemClock


def test_the_clock_never_runs_backwards_and_sleeps_until_its_deadline():
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
