import gc
import math
import tracemalloc

import numpy as np
import pytest

from hil.fleet.clock import SimulatedClock
from mtm_onboard.journal.journal import Journal, JournalHeader, read_journal
from mtm_onboard.links.base import Link
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Channel, MtmError
from mtm_onboard.protocol.journal_file import UNSENT
from mtm_onboard.runtime.guard import NOISE, STALE, STOPPED, Guard, Limits, Staleness
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime
from tests.onboard.schemes import small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)
HEADER = JournalHeader(
    fingerprint="0" * 16, key_id="fake-key", robot="robot0", channel="a", symbols=(2,), repeat=True, rate_hz=50.0,
    start_s=0.0, start_unix_s=None,
)  # fmt: skip


class Listener(Link):
    """Keeps what was sent; fails from the command number `failing_from` on."""

    def __init__(self, failing_from: float = math.inf, *, stop_fails: bool = False) -> None:
        self.commands: list[BodyVelocity] = []
        self.stops = 0
        self._failing_from = failing_from
        self._stop_fails = stop_fails

    def open(self) -> None:
        pass

    def send(self, velocity: BodyVelocity) -> None:
        if len(self.commands) >= self._failing_from:
            raise OSError("cable pulled")
        self.commands.append(velocity)

    def stop(self) -> None:
        self.stops += 1
        if self._stop_fails:
            raise OSError("still pulled")

    def close(self) -> None:
        pass


def plain_guard() -> Guard:
    return Guard(Limits(1.0, 2.0), Staleness(), noise_sigma=0.1, period_s=0.02)


def message(**options) -> Modulator:
    return Modulator(small_codebook(), "a", (2,), **options)


def drive(modulator, ticks, *, last_command_s=math.inf, stop_s=math.inf, journal=None) -> list[BodyVelocity]:
    source, link = HeldSource(), Listener()
    runtime = Runtime(modulator, plain_guard(), source, link, journal)
    for tick in ticks:
        now_s = tick / 50.0
        if now_s <= last_command_s:
            source.set(BASE, now_s)
        if now_s >= stop_s:
            source.stop()
        runtime.step(tick, now_s)
    return link.commands


def test_the_message_rides_on_the_base_command_from_start_to_end():
    modulator = message(repeat=False)
    sent = np.array(drive(modulator, range(-10, 150)))
    noise = np.array([[*modulator.perturbation(tick), 0.0] for tick in range(-10, 150)])
    assert sent == pytest.approx(np.array(BASE) + 0.1 * noise)
    assert not (sent[:10] - BASE).any()
    assert not (sent[130:] - BASE).any()


def test_without_a_modulator_the_base_commands_go_out_alone():
    assert drive(None, range(20)) == [BASE] * 20


def test_a_silent_controller_loses_noise_and_then_motion():
    sent = drive(message(), range(40), last_command_s=0.2)
    assert all(command != BASE for command in sent[:15])
    assert sent[15] == pytest.approx(BASE)  # 0.10 s after the last command
    assert [command.vx_mps for command in sent[15:23]] == pytest.approx([0.3 * (1 - step / 7.5) for step in range(8)])
    assert sent[23:] == [STOP] * 17


def test_the_operator_s_stop_goes_out_in_the_same_tick_and_stays():
    sent = drive(message(), range(30), stop_s=0.2)
    assert STOP not in sent[:10]
    assert sent[10:] == [STOP] * 20


def test_a_link_that_fails_stops_the_robot_and_the_run():
    source, link = HeldSource(), Listener(failing_from=3)
    runtime = Runtime(message(), plain_guard(), source, link)
    for tick in range(3):
        runtime.step(tick, tick / 50.0)
    with pytest.raises(MtmError, match="cable pulled.*told to stop"):
        runtime.step(3, 0.06)
    assert (link.stops, runtime.link_losses) == (1, 1)


def test_the_command_that_broke_the_link_is_journaled_unsent(tmp_path):
    stats, clock = LoopStats(), SimulatedClock()
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        runtime = Runtime(message(), plain_guard(), HeldSource(), Listener(failing_from=3), journal)
        with pytest.raises(MtmError, match="told to stop"):
            run_loop(clock, 50.0, runtime.step, start_s=0.0, stop=lambda: False, stats=stats)
    flags = read_journal(journal.path).flags
    assert [bool(flag & UNSENT) for flag in flags] == [False, False, False, True]
    assert (stats.sent, stats.unsent) == (3, 1)


def test_the_journal_s_lateness_is_the_loop_s_with_missed_ticks(tmp_path):
    class Stalling(SimulatedClock):
        def sleep_until(self, deadline_s: float) -> None:
            super().sleep_until(deadline_s + (0.137 if abs(deadline_s - 0.1) < 1e-6 else 0.0))

    clock = Stalling()
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        runtime = Runtime(message(), plain_guard(), HeldSource(), Listener(), journal)
        stats = run_loop(clock, 50.0, runtime.step, start_s=0.0, stop=lambda: clock.now() >= 0.5)
    assert read_journal(journal.path).lateness_s.max() == pytest.approx(0.137, abs=1e-6)
    assert stats.lateness.worst_s == pytest.approx(0.137)


def test_a_link_that_doubts_is_told_of_in_the_journal_once(tmp_path):
    link = Listener()
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        runtime = Runtime(message(), plain_guard(), HeldSource(), link, journal)
        for tick in range(30):
            link.degraded = "no telemetry" if 10 <= tick < 20 else ""
            runtime.step(tick, tick / 50.0)
    told = [(event.tick, event.text) for event in read_journal(journal.path).events]
    assert told == [(10, "the link is degraded: no telemetry"), (20, "the link is no longer degraded")]
    assert runtime.link_degradations == 1


def test_a_link_on_which_even_the_stop_fails_says_so():
    runtime = Runtime(None, plain_guard(), HeldSource(), Listener(0, stop_fails=True))
    with pytest.raises(MtmError, match="stop the robot by hand"):
        runtime.step(0, 0.0)


def test_a_channel_of_joints_is_refused_before_anything_moves():
    book = small_codebook(channels=(Channel("arm", "arm", ("shoulder",), 1, 0.1),))
    with pytest.raises(MtmError, match="shoulder"):
        Runtime(Modulator(book, "arm", (1,)), plain_guard(), HeldSource(), Listener())


def test_the_journal_tells_what_was_sent_and_why(tmp_path):
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
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        sent = drive(message(), range(60), last_command_s=0.2, stop_s=0.8, journal=journal)
    record = read_journal(journal.path)
    assert record.ticks.tolist() == list(range(60))
    assert record.sent == pytest.approx(np.array(sent))
    assert record.base[:16] == pytest.approx(np.tile(BASE, (16, 1)))
    assert set(record.flags[:15]) == {NOISE}
    assert set(record.flags[15:40]) == {STALE}
    assert set(record.flags[40:]) == {STOPPED}


def test_a_loop_that_loses_ticks_sends_the_same_at_the_others():
    every = drive(message(), range(500))
    source, link, clock = HeldSource(), Listener(), SimulatedClock()
    runtime = Runtime(message(), plain_guard(), source, link)
    ticks = []

    def step(tick: int, now_s: float, _late_s: float) -> None:
        source.set(BASE, now_s)
        runtime.step(tick, now_s)
        ticks.append(tick)
        if tick % 7 == 3:
            clock.sleep_until(now_s + 0.05)

    run_loop(clock, 50.0, step, start_s=0.0, stop=lambda: clock.now() >= 9.99)
    assert len(ticks) < 450
    assert link.commands == [every[tick] for tick in ticks]


def test_a_thousand_ticks_leave_no_memory_behind():
    source = HeldSource()
    runtime = Runtime(Modulator(small_codebook(schedule="rolling"), "b", (3, 0, 2)), plain_guard(), source, Silent())

    def ticks(first: int, count: int) -> None:
        for tick in range(first, first + count):
            source.set(BASE, tick / 50.0)
            runtime.step(tick, tick / 50.0)

    ticks(0, 500)
    gc.collect()
    tracemalloc.start()
    try:
        ticks(500, 100)
        before, _ = tracemalloc.get_traced_memory()
        ticks(600, 1000)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 10_000


class Silent(Listener):
    """Keeps nothing."""

    def send(self, velocity: BodyVelocity) -> None:
        pass
