import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.fleet.clock import SimulatedClock
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.slcan_port import SlcanPort
from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.base import LinkBusyError, TakenOverError
from mtm_onboard.links.none import NullLink
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import HELD, NOISE, UNSENT, JournalHeader, read_journal
from mtm_onboard.runtime.guard import Limits
from mtm_onboard.runtime.modulator import Modulator
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.driven import Driven
from tests.onboard.links.can_rig import VirtualRig, can_rig
from tests.onboard.links.conformance import LinkConformance, Rig
from tests.onboard.schemes import small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)


class TestReconnectingConforms(LinkConformance):
    @pytest.fixture
    def rig(self):
        with can_rig(VirtualRig) as rig:
            link = ReconnectingLink(rig.remake, rig.clock)
            rig.clock.every(link.service_period_s, link.service)
            yield Rig(
                link, rig.controller, rig.plant, rig.clock, lambda: sum(map(len, rig.sent())), clog=rig.clog,
                cut=rig.cut, mend=rig.mend, remake=rig.remake,
            )  # fmt: skip


class Bench:
    """Links that fail when told to, each opening and stop on record with its time."""

    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.error: Exception | None = None
        self.service_error: Exception | None = None
        self.is_absent = False
        self.is_taken_over = False
        self.has_deadman = True
        self.events: list[tuple[float, str]] = []
        self.commands: list[BodyVelocity] = []

    def make(self) -> "BenchLink":
        return BenchLink(self)

    def times_s(self, name: str) -> list[float]:
        return [when_s for when_s, what in self.events if what == name]

    def reconnecting(self, **options) -> ReconnectingLink:
        link = ReconnectingLink(self.make, self.clock, **options)
        self.clock.every(link.service_period_s, link.service)
        return link


class BenchLink(NullLink):
    def __init__(self, bench: Bench) -> None:
        super().__init__()
        self.bench = bench
        self.has_deadman = bench.has_deadman

    def _happens(self, name: str) -> None:
        self.bench.events.append((self.bench.clock.now(), name))

    def open(self) -> None:
        self._happens("open")
        if self.bench.is_absent:
            raise MtmError("no such port")

    def resume(self) -> None:
        if self.bench.is_taken_over:
            raise TakenOverError("a pilot flies it")
        self.open()

    def send(self, velocity: BodyVelocity) -> None:
        if self.bench.error is not None:
            raise self.bench.error
        self.bench.commands.append(velocity)

    def service(self, now_s: float) -> None:
        if self.bench.service_error is not None:
            raise self.bench.service_error

    def stop(self) -> None:
        self._happens("stop")
        if self.bench.error is not None:
            raise self.bench.error

    def close(self) -> None:
        self._happens("close")


@pytest.fixture
def bench():
    return Bench()


def test_while_the_link_is_down_ticks_go_on(bench):
    link = bench.reconnecting()
    link.open()
    driven = Driven(link, bench.clock)
    driven.run(0.1, BASE)
    bench.error, bench.is_absent = OSError("cable pulled"), True
    driven.run(20.0, BASE)
    assert (driven.stats.sent, driven.stats.unsent) == (5, 1000)
    assert (link.losses, link.dropped, driven.guard.unsent) == (1, 1000, 1000)
    assert link.fault == "no such port"
    pauses_s = np.diff([0.1, *bench.times_s("open")[1:]])
    assert pauses_s == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0], abs=0.011)


def test_a_robot_reached_again_drives_on_for_half_a_second(bench):
    bench.has_deadman = False
    link = bench.reconnecting()
    assert not link.has_deadman
    link.open()
    driven = Driven(link, bench.clock)
    driven.run(0.1, BASE)
    bench.error, bench.is_absent = OSError("cable pulled"), True
    driven.run(3.0, BASE)
    pauses_s = np.diff([0.1, *bench.times_s("open")[1:]])
    assert pauses_s == pytest.approx([0.1, 0.2, 0.4, 0.5, 0.5, 0.5, 0.5], abs=0.011)


@pytest.mark.parametrize("where", ["error", "service_error"])
def test_a_link_that_fails_is_released_before_the_next(bench, where):
    with bench.reconnecting() as link:
        driven = Driven(link, bench.clock)
        driven.run(0.1, BASE)
        setattr(bench, where, OSError("cable pulled"))
        driven.run(0.04, BASE)
        assert [name for _, name in bench.events] == ["open", "stop", "close"]
        assert bench.times_s("stop")[0] == pytest.approx(0.11, abs=0.011)
        setattr(bench, where, None)
        driven.run(0.2, BASE)
        assert [name for _, name in bench.events] == ["open", "stop", "close", "open"]
        assert link.up_since_s == pytest.approx(0.2, abs=0.021)


def test_no_motion_before_a_command_from_after_the_return(bench):
    with bench.reconnecting() as link:
        driven = Driven(link, bench.clock, Modulator(small_codebook(), "a", (2,)))
        driven.run(0.5, BASE)
        bench.service_error = OSError("no heartbeat")
        driven.run(0.05, BASE)
        bench.service_error = None
        driven.run(0.2, BASE)  # the last of these came before the link was back as well as after it
        assert link.up_since_s is not None
        bench.commands.clear()
        bench.service_error = OSError("no heartbeat")
        driven.run(0.02)
        bench.service_error = None
        driven.run(1.0)  # and now no command comes at all, although the last one is young at first
        assert link.up_since_s is not None
        assert set(bench.commands[-30:]) == {STOP}
        driven.run(0.1, BASE)
        assert bench.commands[-1] not in (STOP, BASE)


def through_an_outage(bench, modulator=None, limits=None) -> np.ndarray:
    """What is sent from the end of an outage on, in ticks 41 to 140."""
    with bench.reconnecting() as link:
        driven = Driven(link, bench.clock, modulator, limits)
        driven.run(0.5, BASE)
        bench.error, bench.is_absent = OSError("cable pulled"), True
        driven.run(0.3, BASE)
        bench.error, bench.is_absent = None, False
        bench.commands.clear()
        driven.run(2.0, BASE)
    return np.array(bench.commands)


def test_motion_resumes_within_the_acceleration_limit(bench):
    sent = through_an_outage(bench, limits=Limits(1.0, 2.0, acceleration_mps2=5.0))
    speeds_mps = np.vstack([[0.0, 0.0], sent[:, :2]])
    steps_mps = np.hypot(*np.diff(speeds_mps, axis=0).T)
    assert steps_mps.max() <= 5.0 / 50.0 + 1e-9
    assert np.count_nonzero(steps_mps) == 4
    assert (sent[0].tolist(), sent[-1].tolist()) == (list(STOP), list(BASE))


def test_after_an_outage_the_message_is_where_it_is_expected(bench):
    modulator = Modulator(small_codebook(), "a", (2,))
    sent = through_an_outage(bench, modulator)
    assert sent[-60:] == pytest.approx(np.array([modulator.add(tick, BASE) for tick in range(80, 140)]))


def test_a_host_that_stalls_loses_a_command_and_no_link(bench):
    link = bench.reconnecting()
    link.open()
    driven = Driven(link, bench.clock)
    driven.run(0.1, BASE)
    bench.error = LinkBusyError("full")
    driven.run(0.08, BASE)
    bench.error = None
    driven.run(0.1, BASE)
    assert (link.losses, link.dropped, driven.guard.unsent) == (0, 4, 4)
    bench.error = LinkBusyError("full")
    driven.run(0.1, BASE)
    assert link.losses == 1


def test_a_link_that_never_holds_is_given_up(bench):
    link = bench.reconnecting(give_up_s=8.0)
    link.open()
    driven = Driven(link, bench.clock)
    driven.run(6.0, BASE)
    bench.error = OSError("cable pulled")
    with pytest.raises(MtmError, match="down for 8 s"):
        driven.run(60.0, BASE)
    assert bench.clock.now() == pytest.approx(14.0, abs=1.0)
    assert 5 <= len(bench.times_s("open")) <= 8


def test_a_robot_that_could_not_be_told_to_stop_is_no_secret(bench):
    link = bench.reconnecting()
    link.open()
    driven = Driven(link, bench.clock)
    bench.error, bench.is_absent = OSError("cable pulled"), True
    driven.run(0.5, BASE)
    with pytest.raises(MtmError, match="could not be told to stop; switch it off by hand"):
        link.stop()
    opened = len(bench.times_s("open"))
    bench.clock.sleep_until(20.0)
    assert len(bench.times_s("open")) == opened


def test_a_stop_that_got_through_as_the_link_went_down_is_enough(bench):
    with bench.reconnecting() as link:
        driven = Driven(link, bench.clock)
        bench.service_error, bench.is_absent = OSError("no heartbeat"), True
        driven.run(0.5, BASE)


def test_a_link_back_after_the_run_s_end_is_stopped_and_closed(bench):
    link = bench.reconnecting()
    link.open()
    bench.service_error = OSError("no heartbeat")
    bench.clock.sleep_until(0.05)

    class EndingWhileOpening(BenchLink):
        def open(self) -> None:
            super().open()
            link.stop()

    vars(link)["_make"] = lambda: EndingWhileOpening(bench)
    del bench.events[:]
    bench.clock.sleep_until(0.5)
    assert [name for _, name in bench.events] == ["open", "stop", "close"]


def test_a_first_opening_that_fails_is_an_error_at_once(bench):
    bench.is_absent = True
    with pytest.raises(MtmError, match="no such port"):
        bench.reconnecting().open()


def test_an_impossible_command_is_the_caller_s_fault(bench):
    with bench.reconnecting() as link:
        bench.error = ValueError("beyond what the robot takes")
        with pytest.raises(ValueError, match="beyond"):
            link.send(BASE)
        bench.error = None
        assert link.losses == 0


def test_a_robot_taken_over_while_driven_is_not_opened_anew(bench):
    link = bench.reconnecting()
    link.open()
    bench.error = TakenOverError("a pilot flies it")
    with pytest.raises(TakenOverError):
        link.send(BASE)
    bench.error, bench.service_error = None, bench.error
    with pytest.raises(TakenOverError):
        bench.clock.sleep_until(0.1)
    assert (link.losses, len(bench.times_s("open"))) == (0, 1)


def test_a_robot_taken_over_in_an_outage_is_not_opened_anew(bench):
    link = bench.reconnecting()
    link.open()
    bench.service_error, bench.is_taken_over = OSError("radio silence"), True
    with pytest.raises(TakenOverError):
        bench.clock.sleep_until(0.5)
    assert (link.losses, len(bench.times_s("open"))) == (1, 1)


def test_the_journal_of_an_outage_holds_only_what_was_sent(bench, tmp_path):
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=(2, 0, 0, 0),
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    with (
        Journal(tmp_path / "a.csv", header, threaded=False) as journal,
        bench.reconnecting() as link,
    ):
        driven = Driven(link, bench.clock, Modulator(small_codebook(), "a", (2,)), journal=journal)
        driven.run(0.2, BASE)
        bench.error, bench.is_absent = OSError("cable pulled"), True
        driven.run(0.2, BASE)
        bench.error, bench.is_absent = None, False
        driven.run(0.3, BASE)
        driven.source.stop()
        driven.run(0.1, BASE)
    record = read_journal(journal.path)
    assert [event.text for event in record.events] == [
        "the link was lost: cable pulled", "the link is back", "the operator said stop"
    ]  # fmt: skip
    lost, back, stopped = (event.tick for event in record.events)
    assert (lost, stopped) == (11, 35)
    assert record.flags[10] == NOISE | UNSENT
    assert set(record.flags[lost:back]) <= {HELD | UNSENT, HELD}
    assert record.flags[back] == HELD
    assert set(record.flags[back + 1 : stopped]) == {NOISE}
    assert not record.noise[10 : back + 1].any()
    assert record.noise[:10].any(axis=1).all()


def test_health_is_the_wrapper_s_and_the_link_s(bench):
    with bench.reconnecting() as link:
        assert link.health() == {
            "link_up": True, "link_state": "up", "link_trouble": "", "link_losses": 0, "dropped": 0,
        }  # fmt: skip
        bench.service_error, bench.is_absent = OSError("no heartbeat"), True
        bench.clock.sleep_until(0.5)
        assert link.health() == {
            "link_up": False, "link_state": "down", "link_trouble": "no such port", "link_losses": 1, "dropped": 0,
        }  # fmt: skip


def test_a_degraded_link_is_up_and_says_why(bench):
    with bench.reconnecting() as link:
        link.link.degraded = "no telemetry"
        health = link.health()
        assert (health["link_up"], health["link_state"], health["link_trouble"]) == (True, "degraded", "no telemetry")


def test_counters_go_on_over_all_the_links_that_were_used(bench, monkeypatch):
    monkeypatch.setattr(BenchLink, "counters", lambda self: {"refusals": 2}, raising=False)
    with bench.reconnecting() as link:
        for _ in range(2):
            bench.service_error = OSError("no heartbeat")
            bench.clock.sleep_until(bench.clock.now() + 0.02)
            bench.service_error = None
            bench.clock.sleep_until(bench.clock.now() + 1.0)
        assert link.counters() == {"link_losses": 2, "dropped": 0, "refusals": 6}
        assert link.health()["refusals"] == 6


phases = st.lists(
    st.tuples(st.sampled_from(["sound", "failing", "absent", "busy", "unserved"]), st.booleans(), st.integers(1, 30)),
    min_size=1, max_size=12,
)  # fmt: skip


@given(phases)
def test_the_robot_moves_only_for_young_commands_from_after(phases):
    """Phases of so many ticks each, with or without base commands: what reached the robot, against when it may move."""
    bench = Bench()
    link = bench.reconnecting()
    link.open()
    driven = Driven(link, bench.clock, Modulator(small_codebook(), "a", (2,)))
    last_command_s, up_since_s = -math.inf, -math.inf
    for state, is_commanded, ticks in phases:
        bench.error = {"failing": OSError("pulled"), "absent": OSError("pulled"), "busy": LinkBusyError("full")}.get(
            state
        )
        bench.service_error = OSError("no heartbeat") if state == "unserved" else None
        bench.is_absent = state == "absent"
        for _ in range(ticks):
            before = len(bench.commands)
            now_s = bench.clock.now()
            driven.run(0.02, BASE if is_commanded else None)
            if is_commanded:
                last_command_s = now_s
            reached = bench.commands[before:]
            assert len(reached) <= 1
            for velocity in reached:
                if velocity != STOP:
                    assert now_s - last_command_s < 0.25
                    assert last_command_s > up_since_s
            up_since_s = math.inf if link.up_since_s is None else link.up_since_s
    assert driven.guard.unsent == link.dropped
    assert driven.stats.unsent == link.dropped
    assert driven.stats.sent + driven.stats.unsent == sum(ticks for _, _, ticks in phases)


class Adapter:
    """A serial CAN adapter that can be unplugged; the robot behind it has a deadman."""

    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s=0.2)
        self.port: SlcanPort | None = None
        self.plug_in()
        self.clock.every(0.010, self._poll)

    def plug_in(self) -> None:
        self.port = SlcanPort()
        self._node = CanMotionController(self.controller, self.port)

    def unplug(self) -> None:
        assert self.port is not None
        self.port.shutdown()
        self.port = None

    def make(self) -> RoboMasterCan:
        path = "/dev/not-plugged-in" if self.port is None else self.port.path
        return RoboMasterCan(interface="slcan", channel=path, sleep_after_open=0, clock=self.clock)

    def _poll(self, now_s: float) -> None:
        if self.port is None:
            self.controller.advance(now_s)
        else:
            self._node.poll(now_s)


def test_an_adapter_plugged_in_again_drives_on():
    adapter = Adapter()
    link = ReconnectingLink(adapter.make, adapter.clock)
    adapter.clock.every(link.service_period_s, link.service)
    forward = BodyVelocity(0.5, 0.0, 0.0)
    try:
        with link:
            driven = Driven(link, adapter.clock)
            driven.run(0.4, forward)
            assert adapter.plant.velocity_body == forward
            adapter.unplug()
            driven.run(1.0, forward)
            assert adapter.plant.velocity_body == STOP
            assert link.losses == 1
            adapter.plug_in()
            driven.run(1.5)
            assert link.up_since_s is not None
            assert adapter.plant.velocity_body == STOP
            driven.run(0.3, forward)
            assert adapter.plant.velocity_body == forward
        adapter.clock.sleep_until(adapter.clock.now() + 0.05)
        assert adapter.plant.velocity_body == STOP
        assert not adapter.controller.work_mode
    finally:
        adapter.unplug()


def test_an_adapter_that_stops_reading_is_a_lost_link():
    adapter = Adapter()
    link = ReconnectingLink(adapter.make, adapter.clock, give_up_s=math.inf)
    link.open()
    driven = Driven(link, adapter.clock)
    # Nobody polls the far end from here on, and nobody serves the link.
    ticks = 0
    while not link.losses:
        link_busy = link.dropped
        driven.source.set(BASE, adapter.clock.now())
        link.send(BASE)
        ticks += 1
        assert ticks < 2000
    assert link.dropped - 4 <= link_busy <= link.dropped
    assert "in time" in link.fault
    adapter.unplug()
    with pytest.raises(MtmError):
        link.stop()
    link.close()
