"""Sessions that an operator talks to, and sessions whose messages start by the time of day."""

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.control.control_socket import ControlSocket, ask
from mtm_onboard.control.session import Ends, Outcome, Plan, run_session, start_of
from mtm_onboard.journal.journal import read_journal
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.protocol.slots import slot_start_unix_s
from mtm_onboard.runtime.config import config_from_table
from mtm_onboard.runtime.guard import NOISE, STOPPED
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import Command, Source
from tests.onboard.schemes import FAKE_SECRET, small_scheme
from tests.patience import PATIENCE_S

BASE = BodyVelocity(0.3, -0.1, 0.5)
# A message of 0.6 s: six bits and the message's number.
SCHEME = small_scheme(message_ticks=30, schedule="rolling", framing=Framing("integer", 6, number_bits=2))
KEY = Key("fake-key", FAKE_SECRET, SCHEME)
ROLLING, FIXED = small_scheme(schedule="rolling"), small_scheme()
times_s = st.floats(1.8e9, 1.9e9)


class Steady(Source):
    """A source with a fresh command at every poll."""

    def poll(self, now_s: float) -> Command:
        return Command(BASE, now_s, False)


@pytest.fixture
def config(tmp_path, monkeypatch):
    monkeypatch.setattr("mtm_onboard.control.session.StdinSource", Steady)
    return config_from_table(
        {
            "robot": {"name": "r", "channel": "a"},
            "transport": {"kind": "none"},
            "limits": {"speed_mps": 3.0, "turn_rate_radps": 2.0},
            "source": {"kind": "stdin"},
            "journal": {"path": str(tmp_path / "r.csv")},
            "control": {"socket": str(tmp_path / "r.sock")},
        }
    )


class Running:
    """A session in a thread of its own, with a transport that goes nowhere."""

    def __init__(self, config, key: Key, plan: Plan) -> None:
        self._ending = threading.Event()
        self._outcome: Outcome | None = None
        self._thread = threading.Thread(target=self._run, args=(config, key, plan))

    def _run(self, config, key, plan) -> None:
        self._outcome = run_session(config, key, replace(plan, allow_unsynchronised=True), self._ending.is_set)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self.end()

    def end(self) -> Outcome:
        self._ending.set()
        self._thread.join()
        return self._outcome


def asked(config, **request):
    """The answer, as soon as the session listens."""
    patience_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return ask(Path(config.control.socket), request)
        except MtmError as error:
            if "no running robot" not in str(error) or time.monotonic() > patience_s:
                raise


def test_a_message_begins_exactly_at_the_boundary_answered(config):
    with Running(config, KEY, Plan(13)) as running:
        while asked(config, command="status")["tick"] < 3:
            pass
        answer = asked(config, command="send", content={"number": 50})
        while asked(config, command="status")["tick"] < answer["tick"] + 3:
            pass
        outcome = running.end()
    record = with_noise(read_journal(outcome.journal.path), KEY)
    assert slot_start_unix_s(answer["slot"], SCHEME) == pytest.approx(answer["unix_s"], abs=1e-6)
    first_slot = answer["slot"] - answer["tick"] // 30
    assert record.header.start_unix_s == slot_start_unix_s(first_slot, SCHEME)
    before, after = (
        Modulator(KEY.codebook(first_slot), "a", message_of(number, KEY, count)) for count, number in ((0, 13), (1, 50))
    )
    noise = [(after if tick >= answer["tick"] else before).perturbation(tick) for tick in record.ticks.tolist()]
    assert np.any(record.ticks >= answer["tick"])
    # Without the ticks before the message and those whose noise a limit cut.
    calm = record.flags == NOISE
    assert np.mean(calm[record.ticks >= 0]) > 0.9
    assert (record.sent - record.base)[calm, :2] == pytest.approx(0.1 * np.array(noise)[calm], abs=1e-6)
    assert [(event.tick, event.text) for event in record.events if "message" in event.text] == [
        (answer["tick"], "message 1 begins here, number 50")
    ]
    assert not Path(config.control.socket).exists()


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_robot_without_a_message_is_silent_before_and_after(config, schedule):
    key = replace(KEY, scheme=replace(SCHEME, schedule=schedule))
    with Running(config, key, Plan(None)) as running:
        while (before := asked(config, command="status"))["tick"] < 3:
            pass
        begun = asked(config, command="send", content={"number": 50})
        while asked(config, command="status")["tick"] < begun["tick"] + 3:
            pass
        during = asked(config, command="status")
        ended = asked(config, command="silence")
        while asked(config, command="status")["tick"] < ended["tick"] + 3:
            pass
        outcome = running.end()
    assert (before["message"], before["silent"], during["message"], during["silent"]) == ("silence", True, 0, False)
    assert begun["tick"] % 30 == ended["tick"] % 30 == 0
    record = with_noise(read_journal(outcome.journal.path), key)
    assert record.header.symbols is None
    noisy = (record.sent != record.base).any(axis=1)
    within = (record.ticks >= begun["tick"]) & (record.ticks < ended["tick"])
    assert not noisy[~within].any()
    assert np.mean(noisy[within]) > 0.9
    modulator = Modulator(key.codebook((begun["slot"] or 0) - begun["tick"] // 30), "a", message_of(50, key, 0))
    noise = np.array([modulator.perturbation(tick) for tick in record.ticks.tolist()])
    calm = within & (record.flags == NOISE)
    assert (record.sent - record.base)[calm, :2] == pytest.approx(0.1 * noise[calm], abs=1e-6)


def test_the_operator_s_stop_by_the_socket_holds_to_the_end(config):
    with Running(config, replace(KEY, scheme=FIXED), Plan(3)) as running:
        assert asked(config, command="stop") == {"stopped": True}
        sent = asked(config, command="status")["sent"]
        while asked(config, command="status")["sent"] < sent + 5:
            pass
        assert asked(config, command="status")["stopped"]
        record = read_journal(running.end().journal.path)
    assert record.flags[-1] == STOPPED
    assert not record.sent[-4:].any()


def test_a_session_without_its_control_socket_opens_no_link(config, monkeypatch):
    link = NullLink()
    monkeypatch.setattr("mtm_onboard.control.session.make_link", lambda kind, options: link)
    with ControlSocket(Path(config.control.socket)), pytest.raises(MtmError, match="another run"):
        run_session(config, KEY, Plan(1, allow_unsynchronised=True), lambda: True)
    assert link.sent == 0


@given(times_s, st.none() | st.floats(-1e5, 1e5))
def test_a_rolling_message_starts_with_the_next_slot(now_s, later_s):
    start_s, slot = start_of(Plan(1, start_unix_s=None if later_s is None else now_s + later_s), ROLLING, now_s)
    earliest_s = now_s + max(0.1, later_s or 0.0)
    assert start_s == slot_start_unix_s(slot, ROLLING)
    assert earliest_s - 2e-6 <= start_s < earliest_s + 2.4


def test_robots_of_different_starts_play_one_slot_at_one_time():
    starts = [start_of(Plan(1), ROLLING, 1.8e9 + delay_s) for delay_s in (0.0, 1.0, 60.0)]
    assert {round(start_s - 2.4 * slot, 6) for start_s, slot in starts} == {0.0}


def test_a_restart_never_goes_back_to_a_slot_that_was_begun():
    start_s, slot = start_of(Plan(1), ROLLING, 1.8e9)
    assert start_of(Plan(1), ROLLING, start_s)[1] == slot + 1
    assert start_of(Plan(1, start_unix_s=start_s), ROLLING, start_s + 0.01)[1] == slot + 1


@given(times_s)
def test_a_fixed_message_starts_when_it_was_told_to(now_s):
    assert start_of(Plan(1), FIXED, now_s) == (now_s + 0.1, 0)
    assert start_of(Plan(1, start_unix_s=now_s - 7.7), FIXED, now_s) == (now_s - 7.7, 0)


def test_a_clock_never_set_is_refused_under_a_rolling_schedule(config, monkeypatch):
    monkeypatch.setattr("mtm_onboard.model.wall_clock.time.time", lambda: 86_400.0)
    with pytest.raises(MtmError, match="set the clock"):
        run_session(config, KEY, Plan(1), lambda: True)
    assert run_session(config, replace(KEY, scheme=FIXED), Plan(1), lambda: True).stats.sent == 0


class Wall:
    """The time of day of a computer, of which the kernel says `word`."""

    def __init__(self, word: bool | None) -> None:
        self._word = word

    def unix_s(self) -> float:
        return 1.8e9

    def is_synchronised(self) -> bool | None:
        return self._word


def ends(word: bool | None) -> Ends:
    return Ends(
        source=Steady(), transport=NullLink(), clock=SystemClock(), simulated=False, source_name="s", link_name="l",
        stop_by="hand", wall=Wall(word),
    )  # fmt: skip


@pytest.mark.parametrize("word", [False, None])
def test_a_clock_that_nobody_keeps_right_is_refused(config, word):
    with pytest.raises(MtmError, match="--allow-unsynchronised"):
        run_session(config, KEY, Plan(1), lambda: True, ends(word))
    assert run_session(config, replace(KEY, scheme=FIXED), Plan(1), lambda: True, ends(word)).stats.sent == 0
    assert run_session(config, KEY, Plan(1, allow_unsynchronised=True), lambda: True, ends(word)).stats.sent == 0
    assert run_session(config, KEY, Plan(1), lambda: True, ends(True)).stats.sent == 0


def test_a_rolling_run_needs_a_place_for_its_ledger(config):
    with pytest.raises(MtmError, match=r"add \[state\]"):
        run_session(replace(config, journal=None), KEY, Plan(1), lambda: True, ends(True))


def test_numbers_of_messages_go_on_after_a_restart(config):
    numbers = []
    for _ in range(2):
        with Running(config, KEY, Plan(13)) as running:
            numbers.append(asked(config, command="status")["message"])
            numbers.append(asked(config, command="send", content={"number": 50})["number"])
            running.end()
    assert numbers == [0, 1, 2, 3]


@pytest.mark.parametrize("content", [64, "hi", b"hi", (0, 1, 2, 3)])
def test_content_that_does_not_fit_is_refused_before_opening(config, content):
    with pytest.raises(MtmError):
        run_session(config, KEY, Plan(content), lambda: True)
    assert not Path(config.control.socket).exists()
