import os
import sys
import threading
import tomllib
from pathlib import Path

import pytest

from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.config import RealtimeSettings, config_from_table
from mtm_onboard.runtime.realtime import realtime

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="this system has no SCHED_FIFO")


@pytest.fixture
def system(monkeypatch):
    """A system that grants everything; what it was asked for, in order."""
    asked = []
    monkeypatch.setattr(os, "sched_getscheduler", lambda thread: os.SCHED_OTHER)
    monkeypatch.setattr(os, "sched_getparam", lambda thread: os.sched_param(0))
    monkeypatch.setattr(os, "sched_getaffinity", lambda thread: {0, 1, 2})
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda thread, policy, given: asked.append((policy, given.sched_priority))
    )
    monkeypatch.setattr(os, "sched_setaffinity", lambda thread, cpus: asked.append(set(cpus)))
    monkeypatch.setattr("ctypes.CDLL", lambda *_, **__: Libc(asked))
    return asked


class Libc:
    def __init__(self, asked, answer: int = 0) -> None:
        self._asked, self._answer = asked, answer

    def mlockall(self, what: int) -> int:
        self._asked.append("locked")
        return self._answer

    def munlockall(self) -> int:
        self._asked.append("unlocked")
        return 0


def test_what_is_asked_for_is_in_force_within_the_block(system):
    with realtime(RealtimeSettings(priority=40, lock_memory=True, cpu=1), pytest.fail):
        assert system == ["locked", {1}, (os.SCHED_FIFO, 40)]
        system.clear()
    assert system == [(os.SCHED_OTHER, 0), {0, 1, 2}, "unlocked"]


def test_every_thread_of_a_run_has_its_place_below_the_loop():
    placed, ended = threading.Barrier(3), threading.Event()

    def wait() -> None:
        placed.wait(10.0)
        ended.wait(10.0)

    heartbeat, other = threading.Thread(target=wait), threading.Thread(target=wait)
    heartbeat.start()
    other.start()
    placed.wait(10.0)
    switches_s, warnings = sys.getswitchinterval(), []
    try:
        with realtime(RealtimeSettings(priority=10), warnings.append) as place_threads:
            if warnings:
                pytest.skip("this system grants no real-time priority")
            place_threads(heartbeat)
            places = [place(thread) for thread in (threading.main_thread(), heartbeat, other)]
            assert places == [(os.SCHED_FIFO, 10), (os.SCHED_FIFO, 9), (os.SCHED_FIFO, 8)]
            assert sys.getswitchinterval() < switches_s
        assert {place(thread) for thread in (threading.main_thread(), heartbeat, other)} == {(os.SCHED_OTHER, 0)}
        assert sys.getswitchinterval() == switches_s
    finally:
        ended.set()
        heartbeat.join()
        other.join()


def place(thread: threading.Thread) -> tuple[int, int]:
    return os.sched_getscheduler(thread.native_id), os.sched_getparam(thread.native_id).sched_priority


def test_the_lowest_priority_is_everybody_s(system):
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait, daemon=True)
    thread.start()
    with realtime(RealtimeSettings(priority=1), pytest.fail) as place_threads:
        place_threads(thread)
        # The loop's own thread and this one; libraries of other tests may have left some of theirs.
        assert set(system) == {(os.SCHED_FIFO, 1)}
        assert len(system) >= 2
    ended.set()
    thread.join()


def test_no_thread_is_placed_where_nothing_is_asked_or_granted(system, monkeypatch):
    with realtime(RealtimeSettings(cpu=1), pytest.fail) as place_threads:
        place_threads(None)
    assert system == [{1}, {0, 1, 2}]
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    with realtime(RealtimeSettings(priority=40), lambda _: None) as place_threads:
        place_threads(threading.current_thread())


def refused(*_):
    raise PermissionError(1, "Operation not permitted")


def test_it_is_taken_back_when_the_block_fails(system):
    with pytest.raises(MtmError), realtime(RealtimeSettings(priority=40), pytest.fail):
        raise MtmError("the link is down; check it")
    assert system == [(os.SCHED_FIFO, 40), (os.SCHED_OTHER, 0)]


def test_without_the_section_the_system_is_asked_for_nothing(system):
    with realtime(RealtimeSettings(), pytest.fail):
        pass
    assert system == []


def test_what_the_system_refuses_is_one_warning(system, monkeypatch):
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    monkeypatch.setattr("ctypes.CDLL", lambda *_, **__: Libc(system, answer=-1))
    warnings = []
    with realtime(RealtimeSettings(priority=40, lock_memory=True, cpu=1), warnings.append):
        # The rest of what was asked for is in force.
        assert system == ["locked", {1}]
    assert system[2:] == [{0, 1, 2}]
    (warning,) = warnings
    assert "LimitRTPRIO=40" in warning
    assert "LimitMEMLOCK=infinity" in warning
    assert "cpu" not in warning


def test_a_processor_that_is_not_there_is_a_warning():
    warnings = []
    with realtime(RealtimeSettings(cpu=1023), warnings.append):
        pass
    assert "cpu 1023 is refused" in warnings[0]


def test_a_system_without_such_calls_is_a_warning(monkeypatch):
    monkeypatch.delattr(os, "sched_getscheduler")
    warnings = []
    with realtime(RealtimeSettings(priority=1), warnings.append):
        pass
    assert "this system has no SCHED_FIFO" in warnings[0]


def test_only_the_thread_that_asks_is_pinned():
    before = os.sched_getaffinity(0)
    (cpu, *_) = sorted(before)
    there, here = threading.Event(), threading.Event()

    def loop() -> None:
        with realtime(RealtimeSettings(cpu=cpu), pytest.fail):
            seen.append(os.sched_getaffinity(0))
            there.set()
            here.wait(10.0)
        seen.append(os.sched_getaffinity(0))

    seen = []
    thread = threading.Thread(target=loop)
    thread.start()
    there.wait(10.0)
    assert os.sched_getaffinity(0) == before
    here.set()
    thread.join()
    assert seen == [{cpu}, before]


def table(**realtime_section):
    return {
        "robot": {"name": "r", "channel": "a"}, "transport": {"kind": "none"}, "source": {"kind": "stdin"},
        "limits": {"speed_mps": 1.0, "turn_rate_radps": 2.0}, "realtime": realtime_section,
    }  # fmt: skip


def test_the_configuration_may_ask_for_it():
    asked = config_from_table(table(priority=40, lock_memory=True, cpu=3)).realtime
    assert asked == RealtimeSettings(40, True, 3)
    assert config_from_table(table()).realtime == RealtimeSettings()


def test_the_documented_section_is_one_that_can_be_asked_for():
    text = (Path(__file__).parents[3] / "examples/robots/none.toml").read_text(encoding="utf-8")
    _, *lines = text.partition("# [realtime]")[2].partition("\n\n")[0].splitlines()
    section = "\n".join(line.removeprefix("# ") for line in lines)
    assert config_from_table(table(**tomllib.loads(section))).realtime == RealtimeSettings(40, True, 3)


@pytest.mark.parametrize(
    ("section", "sentence"),
    [
        ({"priority": 0}, "choose 1 to 99"),
        ({"priority": 100}, "choose 1 to 99"),
        ({"priority": True}, "give a whole number"),
        ({"cpu": -1}, "from 0 on"),
        ({"cpu": 1 << 40}, "from 0 on"),
        ({"lock_memory": 1}, "give true or false"),
        ({"nice": 1}, "unknown field"),
    ],
)
def test_what_no_system_grants_is_refused(section, sentence):
    with pytest.raises(MtmError, match=sentence):
        config_from_table(table(**section))
