import threading

import pytest

from mtm_onboard.links.none import NullLink
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.runtime.service import ServiceThread


class Attended(NullLink):
    """Tells when it was served three times, and fails after that when asked to."""

    service_period_s = 0.001

    def __init__(self, *, failing: bool) -> None:
        super().__init__()
        self.times_s: list[float] = []
        self.enough = threading.Event()
        self._failing = failing

    def service(self, now_s: float) -> None:
        self.times_s.append(now_s)
        if len(self.times_s) >= 3:
            self.enough.set()
            if self._failing:
                raise OSError("cable pulled")


def test_the_link_is_served_again_and_again_until_the_block_ends():
    link = Attended(failing=False)
    with ServiceThread(link, SystemClock()) as service:
        assert link.enough.wait(10.0)
    assert service.error is None
    assert link.times_s == sorted(link.times_s)
    assert "service" not in {thread.name for thread in threading.enumerate()}


def test_a_failure_ends_the_service_and_is_kept():
    link = Attended(failing=True)
    with ServiceThread(link, SystemClock()) as service:
        assert link.enough.wait(10.0)
    assert str(service.error) == "cable pulled"
    assert len(link.times_s) == 3


def test_whatever_ends_the_thread_is_an_error():
    class Ending(NullLink):
        def service(self, now_s: float) -> None:
            raise SystemExit

    with ServiceThread(Ending(), SystemClock()) as service:
        vars(service)["_thread"].join(10.0)
        assert isinstance(service.error, SystemExit)


def test_a_call_that_never_returns_does_not_hold_up_the_end(monkeypatch):
    monkeypatch.setattr("mtm_onboard.runtime.service._LONGEST_FAREWELL_S", 0.05)
    begun, released = threading.Event(), threading.Event()

    class Wedged(NullLink):
        def service(self, now_s: float) -> None:
            begun.set()
            released.wait(20.0)

    with ServiceThread(Wedged(), SystemClock()) as service:
        assert begun.wait(10.0)
    thread = vars(service)["_thread"]
    assert thread.is_alive()
    released.set()
    thread.join(10.0)
    assert not thread.is_alive()


class Script:
    """A clock on which nothing takes time but the calls, and those as long as said, and the waits in between."""

    def __init__(self, call_lengths_s) -> None:
        self.now_s = 0.0
        self.begun_s: list[float] = []
        self._lengths_s = iter(call_lengths_s)
        self._is_over = False

    def now(self) -> float:
        return self.now_s

    def serve(self, now_s: float) -> None:
        self.begun_s.append(now_s)
        length_s = next(self._lengths_s, None)
        self._is_over = length_s is None
        self.now_s += length_s or 0.0

    def is_set(self) -> bool:
        return self._is_over

    def wait(self, timeout_s: float) -> None:
        assert timeout_s >= 0.0
        self.now_s += timeout_s


def calls_s(call_lengths_s) -> list[float]:
    """When a link with a period of 10 ms is served whose calls last so long."""
    script, link = Script(call_lengths_s), NullLink()
    link.service = script.serve
    service = ServiceThread(link, script)
    vars(service)["_ending"] = script
    service._run()
    return script.begun_s


def test_a_call_s_length_makes_none_of_the_next_ones_late():
    assert calls_s([0.004, 0.0, 0.009, 0.001]) == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04])


def test_periods_that_a_long_call_has_missed_are_skipped():
    assert calls_s([0.0, 0.053, 0.0]) == pytest.approx([0.0, 0.01, 0.07, 0.08])
