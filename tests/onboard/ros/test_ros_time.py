"""Ticks under a clock that others advance, with no ROS about."""

import pytest

from mtm_onboard.protocol import MtmError
from mtm_onboard.ros.ros_time import RosTime
from mtm_onboard.runtime.loop import run_loop

PERIOD_S = 0.02


class Published:
    """A clock that goes on by the next of `steps_s` each time that somebody has waited for it; then it stands still."""

    def __init__(self, steps_s, monkeypatch) -> None:
        self.time_s = 100.0
        self.ended = False
        self.warnings: list[str] = []
        self._steps = iter(steps_s)
        monkeypatch.setattr("mtm_onboard.ros.ros_time.time.sleep", self._wait)
        self.clock = RosTime(lambda: self.time_s, PERIOD_S, lambda: self.ended, self.warnings.append)

    def _wait(self, seconds: float) -> None:
        step_s = next(self._steps, None)
        self.ended = step_s is None
        self.time_s += step_s or 0.0

    def ticks(self) -> list[int]:
        """Those that a loop at 50 Hz has until the clock stands still."""
        ticks: list[int] = []
        run_loop(
            self.clock, 1.0 / PERIOD_S, lambda tick, *_: ticks.append(tick), start_s=100.0, stop=lambda: self.ended
        )
        return ticks


def test_ticks_come_from_the_time_and_not_from_the_messages(monkeypatch):
    published = Published([0.005] * 398, monkeypatch)
    assert published.ticks() == list(range(100))
    assert published.warnings == []


def test_too_coarse_a_clock_is_told_once_and_ticks_keep_numbers(monkeypatch):
    published = Published([0.1] * 50, monkeypatch)
    assert published.ticks() == list(range(0, 255, 5))
    (warning,) = published.warnings
    assert "in steps of 0.100 s" in warning
    assert "50 Hz or more" in warning


def test_steps_of_a_tick_are_short_and_one_long_one_is_no_habit(monkeypatch):
    published = Published([0.02] * 50 + [0.5] + [0.02] * 50, monkeypatch)
    assert len(published.ticks()) == 102
    assert published.warnings == []


def test_a_clock_that_goes_back_ends_the_run_with_one_sentence(monkeypatch):
    published = Published([0.01] * 10 + [-5.0] + [0.01] * 10, monkeypatch)
    with pytest.raises(MtmError, match="went back by 5.000 s"):
        published.ticks()


def test_a_clock_that_stands_still_does_not_outlast_the_end(monkeypatch):
    published = Published([], monkeypatch)
    published.clock.sleep_until(200.0)
    assert published.ended
