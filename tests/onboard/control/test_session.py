import math
import socket
import threading
from dataclasses import replace
from itertools import count

import pytest

from mtm_onboard.control.session import Plan, run_session
from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Channel, Key, MtmError
from mtm_onboard.runtime.config import JournalSettings, LinkSettings, RealtimeSettings, RobotConfig, config_from_table
from mtm_onboard.runtime.source import Source
from tests.onboard.schemes import FAKE_SECRET, small_scheme
from tests.patience import PATIENCE_S

KEY = Key("fake-key", FAKE_SECRET, small_scheme())


class Link(NullLink):
    """Fails where it is told to, and keeps what happened in order."""

    def __init__(self, failing: str = "", failing_from: int = 2) -> None:
        super().__init__()
        self.events: list[str] = []
        self._failing = failing
        self._failing_from = failing_from
        self._served = count(1)

    def open(self) -> None:
        self.events.append("open")
        if self._failing == "open":
            raise MtmError("cannot open the link; plug it in")

    def send(self, velocity: BodyVelocity) -> None:
        super().send(velocity)
        if self._failing == "send" and self.sent >= self._failing_from:
            raise OSError("cable pulled")

    def service(self, now_s: float) -> None:
        if self._failing == "service" and next(self._served) >= self._failing_from:
            raise OSError("no heartbeat")

    def stop(self) -> None:
        self.events.append("stop")

    def close(self) -> None:
        self.events.append("close")


@pytest.fixture
def config() -> RobotConfig:
    return config_from_table(
        {
            "robot": {"name": "r", "channel": "a"},
            "transport": {"kind": "none"},
            "link": {"reconnect": False},
            "limits": {"speed_mps": 1.0, "turn_rate_radps": 2.0},
            "source": {"kind": "stdin"},
        }
    )


@pytest.fixture
def use(monkeypatch):
    monkeypatch.setattr("mtm_onboard.control.session.StdinSource", Silence)

    def patch(link: Link) -> Link:
        monkeypatch.setattr("mtm_onboard.control.session.make_link", lambda kind, options: link)
        return link

    return patch


class Silence(Source):
    """A source that no command ever comes from."""

    def poll(self, now_s: float) -> tuple[BodyVelocity, float, bool]:
        return STOP, -math.inf, False


def never() -> bool:
    return False


def test_a_run_opens_the_link_and_leaves_it_stopped_and_closed(config, use):
    link = use(Link())
    outcome = run_session(config, KEY, Plan((0, 1, 2, 3), duration_s=0.0), never)
    assert link.events == ["open", "stop", "stop", "close"]
    assert link.sent == outcome.stats.sent
    assert "ticks sent" in outcome.summary()
    assert "journal" not in outcome.summary()


def test_a_run_that_is_to_end_at_once_sends_only_the_stop(config, use):
    link = use(Link())
    assert run_session(config, KEY, Plan(None), lambda: True).stats.sent == 0
    assert link.events == ["open", "stop", "stop", "close"]


@pytest.mark.parametrize(("failing", "sentence"), [("send", "cable pulled"), ("service", "no heartbeat")])
def test_a_link_that_fails_on_the_way_stops_the_robot(config, use, failing, sentence):
    link = use(Link(failing))
    with pytest.raises(MtmError, match=sentence):
        run_session(config, KEY, Plan((0, 1, 2, 3)), never)
    assert link.events[0] == "open"
    assert link.events[-2:] == ["stop", "close"]
    assert "service" not in {thread.name for thread in threading.enumerate()}


def test_a_robot_that_is_not_there_is_an_error_and_no_run(config, tmp_path):
    journal = {"path": str(tmp_path / "a.csv")}
    can = replace(
        config, transport_kind="robomaster-can", transport_options={"interface": "virtual", "channel": "void"}
    )
    with pytest.raises(MtmError, match="Nothing has come from the robot"):
        run_session(replace(can, journal=JournalSettings(**journal)), KEY, Plan((0, 1, 2, 3)), never)
    assert not (tmp_path / "a.csv").exists()


def test_the_summary_tells_what_the_link_counted(config, use):
    class Counting(Link):
        degraded = "no telemetry"

        def counters(self) -> dict[str, int]:
            return {"missed_heartbeats": 3, "refusals": 0}

        def send(self, velocity: BodyVelocity) -> None:
            super().send(velocity)
            if self.sent > 3:
                raise LinkBusyError("full")

    link = use(Counting())
    outcome = run_session(replace(config, link=LinkSettings()), KEY, Plan((0, 1, 2, 3)), lambda: link.sent >= 6)
    told = outcome.summary()
    assert (outcome.stats.sent, outcome.stats.unsent) == (3, 3)
    assert told.startswith("3 ticks sent, 3 unsent, ")
    assert "1 times degraded" in told
    assert told.endswith("; the link counted: dropped 3, missed heartbeats 3")


def test_a_link_that_does_not_open_is_an_error(config, use):
    link = use(Link("open"))
    with pytest.raises(MtmError, match="plug it in"):
        run_session(config, KEY, Plan(None), never)
    assert link.sent == 0


def test_what_does_not_fit_the_key_is_refused_before_the_link(config, use):
    link = use(Link())
    arm = replace(KEY, scheme=small_scheme(channels=(Channel("a", "arm", ("shoulder",), 1, 0.1),)))
    for key, message in ((KEY, (0, 1)), (arm, (1,))):
        with pytest.raises(MtmError):
            run_session(config, key, Plan(message), never)
    with pytest.raises(MtmError, match="no channel 'z'"):
        run_session(replace(config, robot=replace(config.robot, channel="z")), KEY, Plan(None), never)
    assert link.events == []


def test_a_link_that_comes_back_is_opened_and_its_losses_told(config, use):
    link = use(Link("send"))
    config = replace(config, link=LinkSettings())
    plan = Plan((0, 1, 2, 3), duration_s=30.0)
    outcome = run_session(config, KEY, plan, lambda: link.events.count("open") >= 2)
    assert outcome.link_losses >= 1
    assert "link losses" in outcome.summary()
    assert link.events[:3] == ["open", "stop", "close"]
    assert link.events[-1] == "close"


def test_steps_of_the_system_s_time_do_not_touch_a_run(config, use, monkeypatch):
    link, hours = use(Link()), count()
    # Set right, an hour back, two hours back ...
    monkeypatch.setattr("mtm_onboard.model.wall_clock.time.time", lambda: 1.7e9 - 3600.0 * next(hours))

    class Impatient(SystemClock):
        def sleep_until(self, deadline_s: float) -> None:
            assert deadline_s < self.now() + PATIENCE_S, "the run waits for what a step of the time has moved away"
            super().sleep_until(deadline_s)

    monkeypatch.setattr("mtm_onboard.control.session.SystemClock", Impatient)
    stats = run_session(config, KEY, Plan((0, 1, 2, 3)), lambda: link.sent >= 5).stats
    assert stats.sent == 5
    # An hour's step would count 180,000 as missed.
    assert stats.missed < 50 * PATIENCE_S


def test_the_robot_stops_before_a_wedged_thread_is_waited_for(config, use, monkeypatch):
    monkeypatch.setattr("mtm_onboard.runtime.service._LONGEST_FAREWELL_S", 20.0)

    class Wedged(Link):
        def __init__(self) -> None:
            super().__init__()
            self.told = threading.Event()

        def service(self, now_s: float) -> None:
            if not self.told.wait(20.0):
                self.events.append("waited in vain")

        def stop(self) -> None:
            super().stop()
            self.told.set()

    link = use(Wedged())
    run_session(config, KEY, Plan(None, duration_s=0.0), never)
    assert link.events == ["open", "stop", "stop", "close"]


def test_the_service_manager_hears_of_the_loop_by_the_loop(config, use, tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        # So short that every tick is due to feed.
        monkeypatch.setenv("WATCHDOG_USEC", "4")
        opened = []

        class Opening(Link):
            def open(self) -> None:
                super().open()
                opened.append(heard(manager))

            def send(self, velocity: BodyVelocity) -> None:
                super().send(velocity)
                words.extend(heard(manager))

            def stop(self) -> None:
                super().stop()
                words.extend(heard(manager))

        words: list[bytes] = []
        link = use(Opening())
        run_session(config, KEY, Plan(None), lambda: link.sent >= 3)
    # Nothing before the link was up, and all of it by the time the robot is told to stop.
    assert opened == [[]]
    assert words == [b"READY=1\n", *[b"WATCHDOG=1\n"] * 4, b"STOPPING=1\n"]


def test_a_loop_that_hangs_is_not_said_to_be_alive(config, use, tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "1000")

        class Hanging(Link):
            def send(self, velocity: BodyVelocity) -> None:
                heard(manager)
                # Many watchdog periods, in which the service's thread goes on.
                threading.Event().wait(0.05)
                words.extend(heard(manager))
                super().send(velocity)

        words: list[bytes] = []
        use(Hanging("send", failing_from=1))
        with pytest.raises(MtmError):
            run_session(config, KEY, Plan(None), never)
    assert words == []


def heard(manager: socket.socket) -> list[bytes]:
    words = []
    while True:
        try:
            words.append(manager.recv(100))
        except BlockingIOError:
            return words


def test_refused_real_time_is_told_and_the_run_goes_on(config, use, capsys):
    link = use(Link())
    config = replace(config, realtime=RealtimeSettings(cpu=1023))
    run_session(config, KEY, Plan(None), lambda: link.sent > 0)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mtm-onboard: [realtime]")
