"""A robot whose time of day jumps: no slot is played twice, and each jump is told in one sentence."""

import math
import random
from contextlib import suppress
from dataclasses import dataclass
from datetime import date, timedelta

import numpy as np
import pytest

from hil.fleet.clock import SimulatedClock
from mtm_onboard.control.session import Ends, Plan, run_session
from mtm_onboard.journal.journal import read_journal
from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.disclosure import anchor_of
from mtm_onboard.protocol.key import generate_master
from mtm_onboard.protocol.public_channel import public_key
from mtm_onboard.protocol.slots import slot_at
from mtm_onboard.runtime.config import config_from_table
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.source import Command, Source
from tests.onboard.schemes import FAKE_SECRET, small_scheme

# A message of 2.4 s.
SCHEME = small_scheme(schedule="rolling")
KEY = Key("fake-key", FAKE_SECRET, SCHEME)
NOON_UNIX_S = 1_800_000_000.0
HOUR_S = 3600.0


class SetClock:
    """The time of day, ahead of the simulation's by what it is set to at times of the simulation."""

    def __init__(self, clock: SimulatedClock, ahead_s: float, steps: tuple[tuple[float, float], ...]) -> None:
        self._clock, self._ahead_s, self._steps = clock, ahead_s, steps
        self.synchronised: bool | None = True

    def unix_s(self) -> float:
        now_s = self._clock.now()
        ahead_s = self._ahead_s + sum(by_s for at_s, by_s in self._steps if now_s >= at_s)
        return NOON_UNIX_S + now_s + ahead_s

    def is_synchronised(self) -> bool | None:
        return self.synchronised


class Steady(Source):
    """A source with a fresh command at every poll."""

    def poll(self, now_s: float) -> Command:
        return Command(STOP, now_s, False)


class Heard(NullLink):
    """What the robot was told, with the time of day at which it was."""

    def __init__(self, clock: SetClock) -> None:
        super().__init__()
        self._clock = clock
        self.noise: list[tuple[float, BodyVelocity]] = []

    def send(self, velocity: BodyVelocity) -> None:
        super().send(velocity)
        if velocity != STOP:
            self.noise.append((self._clock.unix_s(), velocity))


@dataclass
class Day:
    """Runs of one robot, one after the other; `began_s` is when the next one begins."""

    folder: object
    began_s: float = 0.0
    key: Key = KEY
    message: int | bytes = 7

    def run(self, seconds: float, ahead_s: float = 0.0, *steps: tuple[float, float], killed: bool = False):
        """One run whose clock is ahead by so much, and is set by `steps`: (seconds since its start, by how much)."""
        clock = SimulatedClock()
        wall = SetClock(clock, ahead_s + self.began_s, steps)
        link = Heard(wall)
        config = config_from_table(
            {
                "robot": {"name": "r", "channel": "a"},
                "transport": {"kind": "none"},
                "limits": {"speed_mps": 3.0, "turn_rate_radps": 2.0},
                "source": {"kind": "stdin"},
                "journal": {"path": str(self.folder / "r.csv")},
            }
        )
        ends = Ends(
            source=Steady(), transport=link, clock=clock, simulated=False, source_name="s", link_name="l",
            stop_by="hand", wall=wall,
        )  # fmt: skip
        said: list[str] = []

        def ended() -> bool:
            if killed and clock.now() >= seconds:
                raise PowerCutError
            return clock.now() >= seconds

        path = None
        with suppress(PowerCutError):
            path = run_session(config, self.key, Plan(self.message), ended, ends, said.append).journal.path
        self.began_s += seconds
        events = [] if path is None else [event.text for event in read_journal(path).events]
        return link.noise, events, said


class PowerCutError(Exception):
    pass


@pytest.fixture
def day(tmp_path):
    return Day(tmp_path)


def told(events):
    return [text for text in events if "time of day" in text or "played before" in text]


def repeated(*runs):
    """Ticks whose noise is that of another; rounding takes no two together."""
    velocities = [velocity for noise, *_ in runs for _, velocity in noise]
    return len(velocities) - len(set(velocities))


def test_a_clock_that_is_right_plays_slot_after_slot(day):
    noise, events, _ = day.run(30.0)
    # From the first slot on, every tick.
    assert len(noise) >= 50 * (30.0 - 2.4 - 0.2)
    assert told(events) == []


@pytest.mark.parametrize("step_s", [HOUR_S, -2 * HOUR_S, 1.3, -1.3])
def test_a_step_during_a_run_is_told_and_planned_anew(day, step_s):
    noise, events, _ = run = day.run(40.0, 0.0, (20.0, step_s))
    assert repeated(run) == 0
    way = "forward" if step_s > 0 else "back"
    assert (
        told(events)[0]
        == f"the time of day was set {way} by {abs(step_s):.1f} s: no noise until it is known to be right"
    )
    assert len(told(events)) == 2
    assert told(events)[1].startswith(
        f"the time of day was set {way} by {abs(step_s):.1f} s: the message begins anew at 2027-"
    )
    after = [
        unix_s for unix_s, _ in noise if unix_s > NOON_UNIX_S + 21.2 + step_s and unix_s - NOON_UNIX_S - step_s < 41
    ]
    if step_s == -2 * HOUR_S:
        # All slots of the next two hours were played by the clock of before.
        assert len(noise) < 50 * 21.1
    else:
        assert len(after) > 50 * 10


@pytest.mark.parametrize("step_s", [HOUR_S, -HOUR_S])
def test_noise_after_a_step_is_that_of_its_slot(day, step_s):
    clock_now = day.run(40.0, 0.0, (20.0, step_s))[0]
    late = [entry for entry in clock_now if entry[0] > NOON_UNIX_S + step_s + 25.0]
    if step_s < 0:
        assert all(unix_s < NOON_UNIX_S + 21.2 for unix_s, _ in clock_now)
        return
    codebook = KEY.codebook(slot_at(late[0][0], SCHEME))
    # Half a tick at most lies between the grid of ticks and the slots.
    for unix_s, velocity in late[:400]:
        slot = slot_at(unix_s + 0.0101, SCHEME)
        samples = codebook.samples(SCHEME.channels[0], slot - codebook.first_slot)
        tick = (unix_s - 2.4 * slot) * 50.0
        near = [samples[:, 0, place] for place in (math.floor(tick), math.ceil(tick)) if 0 <= place < samples.shape[2]]
        assert any(abs(0.1 * value - velocity.vx_mps) < 1e-9 for values in near for value in values)


@pytest.mark.parametrize("ahead_s", [0.0, HOUR_S, -2 * HOUR_S])
def test_a_restart_with_another_clock_plays_nothing_again(day, ahead_s):
    first = day.run(20.0)
    second = day.run(20.0, ahead_s)
    assert repeated(first, second) == 0
    if ahead_s < 0:
        assert second[0] == []
        assert len(told(second[1])) == 1
        assert "may have been played before" in told(second[1])[0]
        assert sum("may have been played before" in text for text in second[2]) == 1
    else:
        assert len(second[0]) > 50 * 14
        assert told(second[1]) == []


@pytest.mark.parametrize("ahead_s", [0.0, -10.0])
def test_a_power_cut_and_an_old_clock_play_nothing_again(day, monkeypatch, ahead_s):
    with monkeypatch.context() as cut:
        cut.setattr(Ledger, "release", lambda self, slot: None)
        first = day.run(20.0, killed=True)
    second = day.run(40.0, ahead_s)
    assert repeated(first, second) == 0
    assert len(second[0]) > 50 * 10


@pytest.mark.parametrize("step_s", [HOUR_S, -2 * HOUR_S])
def test_a_step_at_the_very_start_plays_nothing_again(day, step_s):
    """Before the first slot has begun, between the plan and the slot that it is for."""
    first = day.run(20.0)
    second = day.run(20.0, 0.0, (0.05, step_s))
    assert repeated(first, second) == 0
    way = "forward" if step_s > 0 else "back"
    known = f"the time of day was set {way} by {abs(step_s):.1f} s: no noise until it is known to be right"
    assert [text for text in told(second[1]) if "no noise" in text] == [known]
    assert len(told(second[1])) == 2


@pytest.mark.parametrize("seed", range(12))
def test_no_walk_of_the_clock_plays_a_slot_twice(tmp_path, seed):
    """Steps either way at any time, restarts and power cuts in any order; each step is told once."""
    draw, day = random.Random(seed), Day(tmp_path)
    runs, ahead_s = [], 0.0
    for _ in range(4):
        ahead_s += draw.choice([0.0, 0.0, HOUR_S, -2 * HOUR_S, 30.0, -30.0, 2.4])
        steps = tuple((draw.uniform(0.0, 18.0), draw.choice([HOUR_S, -2 * HOUR_S, 5.0, -5.0])) for _ in range(2))
        # Two within one look at the clock are told as one.
        apart = steps if abs(steps[0][0] - steps[1][0]) > 2.5 else steps[:1]
        runs.append(day.run(24.0, ahead_s, *apart, killed=draw.random() < 0.3))
        ahead_s += sum(by_s for _, by_s in apart)
        told_steps = [text for text in told(runs[-1][1]) if "no noise until" in text]
        assert len(told_steps) == len(apart) or not runs[-1][1]
    assert repeated(*runs) == 0
    assert any(noise for noise, *_ in runs)


def test_a_clock_that_is_set_wrong_and_right_again(day):
    run = day.run(60.0, 0.0, (20.0, HOUR_S), (40.0, -HOUR_S))
    second = day.run(20.0)
    assert repeated(run, second) == 0
    # Slots up to an hour ahead were played.
    assert second[0] == []


def test_a_step_waits_until_the_clock_is_trusted(day, monkeypatch):
    wall = {}
    former = SetClock.is_synchronised

    def lost(self):
        wall["asked"] = wall.get("asked", 0) + 1
        return self.synchronised if self._clock.now() < 20.0 or self._clock.now() > 30.0 else False

    monkeypatch.setattr(SetClock, "is_synchronised", lost)
    noise, events, _ = day.run(40.0, 0.0, (20.0, HOUR_S))
    monkeypatch.setattr(SetClock, "is_synchronised", former)
    silent = [unix_s for unix_s, _ in noise if NOON_UNIX_S + HOUR_S + 21.1 < unix_s < NOON_UNIX_S + HOUR_S + 30.0]
    assert silent == []
    assert any(unix_s > NOON_UNIX_S + HOUR_S + 34.0 for unix_s, _ in noise)
    assert len(told(events)) == 2
    assert wall["asked"] > 5


def issued(first: date, days: int) -> Key:
    master = generate_master("fake-key", SCHEME, date(2027, 1, 1), 60).holding
    return Key("fake-key", master.for_robot(["a"], first, first + timedelta(days - 1)), SCHEME)


def test_after_the_key_s_last_day_the_robot_drives_on_in_silence(tmp_path):
    # The run begins twenty seconds before midnight.
    midnight_s = (NOON_UNIX_S // 86_400 + 1) * 86_400
    day = Day(tmp_path, midnight_s - 20.0 - NOON_UNIX_S, issued(date(2027, 1, 15), 1))
    noise, _, _ = day.run(60.0)
    assert len(noise) > 50 * 15
    assert max(unix_s for unix_s, _ in noise) < midnight_s + 2.4


def test_a_step_to_a_day_without_a_key_is_told_and_silent(tmp_path):
    day = Day(tmp_path, key=issued(date(2027, 1, 15), 2))
    noise, events, _ = day.run(60.0, 0.0, (20.0, 30 * 86_400.0), (40.0, -30 * 86_400.0))
    # The step is seen within a second.
    assert not any(unix_s > NOON_UNIX_S + 30 * 86_400.0 + 21.1 for unix_s, _ in noise)
    said = [text for text in told(events) if "no noise (this key file is for days up to 2027-01-16" in text]
    assert len(said) == 1
    # The right time again: what follows was not played before.
    assert repeated((noise,)) == 0
    assert any(unix_s > NOON_UNIX_S + 45.0 for unix_s, _ in noise)


def test_a_disclosed_key_is_played_between_own_messages(tmp_path):
    """By the public channel's slots, and with a place of its own in the ledger."""
    master = Key("fake-key", generate_master("fake-key", SCHEME, date(2027, 1, 1), 60).holding, SCHEME)
    own, public = issued(date(2027, 1, 15), 1), public_key(anchor_of(master))
    link = master.holding.disclosed(date(2027, 1, 14)).link
    day = Day(tmp_path, key=own)
    before = day.run(20.0)
    day.key, day.message = public, link
    slot_s = public.scheme.message_ticks / public.scheme.rate_hz
    noise, events, said = carried = day.run(2.2 * slot_s)
    day.key, day.message = own, 7
    after = day.run(20.0)
    assert repeated(before, carried, after) == 0
    assert len(noise) > 50 * slot_s
    assert min(len(run[0]) for run in (before, after)) > 50 * 14
    assert told(events) == []
    assert any(f"bytes {link.hex()}" in sentence for sentence in said)
    # Its first slot, as everybody with the anchor has it.
    slot = slot_at(noise[0][0] + 0.0101, public.scheme)
    book, symbols = public.codebook(slot), message_of(link, public).symbols(slot)
    channel = public.scheme.channels[0]
    # The guard cuts what is beyond four sigma.
    expected = np.clip(0.1 * book.samples(channel, 0, [symbols[0]])[0, 0], -0.4, 0.4)
    played = [velocity.vx_mps for _, velocity in noise[: len(expected)]]
    assert max(abs(one - other) for one, other in zip(played, expected, strict=True)) < 1e-9
    assert (tmp_path / "r.csv.state").read_text().count("[[keys]]") == 2


def test_a_disk_that_is_full_ends_the_noise(day, monkeypatch):
    def full(self, slot):
        if slot > slot_at(NOON_UNIX_S, SCHEME) + 6:
            raise MtmError("cannot write r.state: No space left on device; make room on its disk")
        reserve(self, slot)

    reserve = Ledger.reserve
    monkeypatch.setattr(Ledger, "reserve", full)
    noise, events, _ = day.run(40.0)
    assert max(unix_s for unix_s, _ in noise) <= NOON_UNIX_S + 7 * 2.4
    assert sum("the noise ends" in text for text in events) == 1
