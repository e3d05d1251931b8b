import json
import math
from itertools import count

import pytest

from mtm_onboard.control.control import Control, Session
from mtm_onboard.control.slot_watch import Playing
from mtm_onboard.journal.journal import Journal, JournalHeader, read_journal
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.runtime.guard import Guard, Limits, Staleness
from mtm_onboard.runtime.loop import LoopStats
from mtm_onboard.runtime.message import SILENCE, FramedMessage, message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from tests.onboard.schemes import FAKE_SECRET, small_scheme

FIRST_SLOT = 40_000
START_UNIX_S = FIRST_SLOT * 2.4


class Ticking(Modulator):
    """A tick comes as soon as something was queued, at `now`."""

    now = 0

    def queue(self, message):
        queued = super().queue(message)
        self.prepare(self.now)
        return queued


class Robot:
    """A session's parts, of which nothing moves."""

    def __init__(self, key: Key, content=None, journal: Journal | None = None) -> None:
        self.tick = 55
        codebook = key.codebook(FIRST_SLOT)
        self.modulator = Ticking(codebook, "a", SILENCE if content is None else message_of(content, key))
        self.guard = Guard(Limits(1.0, 2.0), Staleness(), noise_sigma=0.1, period_s=0.02)
        self.stats, self.source = LoopStats(), HeldSource()
        playing = Playing(modulator=self.modulator, first_tick=0, first_slot=FIRST_SLOT, start_unix_s=START_UNIX_S)
        session = Session(
            robot="robot0",
            key=key,
            guard=self.guard,
            source=self.source,
            transport=NullLink(),
            stats=self.stats,
            journal=journal,
            now_s=lambda: (self.tick + 0.5) / 50.0,
            start_s=0.0,
            playing=lambda: playing,
            plays=self.modulator.sends,
            clock_doubt=str,
            take_number=count(1).__next__,
        )
        self.control = Control(session)

    def send(self, **content):
        return self.control.answer({"command": "send", "content": content})


def key_of(**changes) -> Key:
    return Key("fake-key", FAKE_SECRET, small_scheme(**({"schedule": "rolling"} | changes)))


def test_a_new_message_is_answered_with_its_boundary():
    robot = Robot(key_of(), 7)
    robot.modulator.now = 130
    answer = robot.send(number=9)
    assert answer == {
        "tick": 240, "unix_s": START_UNIX_S + 4.8, "slot": FIRST_SLOT + 2, "number": 1, "content": "number 9",
        "replaces": None,
    }  # fmt: skip
    assert robot.modulator.waiting == message_of(9, key_of(), 1)


def test_under_the_fixed_schedule_there_is_no_slot_to_name():
    assert Robot(key_of(schedule="fixed"), 7).send(number=9)["slot"] is None


def test_messages_are_numbered_and_a_replaced_one_is_named():
    robot = Robot(key_of(framing=Framing("integer", 4, number_bits=2)), 7)
    answers = [robot.send(number=number) for number in (1, 2)]
    robot.modulator.now = 240
    robot.modulator.prepare(240)
    answers.append(robot.send(number=3))
    assert [(answer["number"], answer["replaces"]) for answer in answers] == [(1, None), (2, 1), (3, None)]
    assert isinstance(robot.modulator.waiting, FramedMessage)
    assert (robot.modulator.message.number, robot.modulator.message.payload) == (2, 2)


def test_a_message_that_does_not_fit_takes_no_number():
    robot = Robot(key_of(), 7)
    for content, sentence in (
        ({"number": 999}, "does not fit"),
        ({"text": "hi"}, "plain numbers"),
        ({}, "exactly one"),
    ):
        with pytest.raises(MtmError, match=sentence):
            robot.send(**content)
    assert robot.modulator.waiting is None
    assert robot.send(number=1)["number"] == 1


def test_a_loop_that_stands_still_takes_up_nothing(monkeypatch):
    monkeypatch.setattr("mtm_onboard.control.control._PATIENCE_S", 0.01)
    robot = Robot(key_of(), 7)
    robot.modulator.prepare = lambda tick: None
    with pytest.raises(MtmError, match="stands still"):
        robot.send(number=1)
    del robot.modulator.prepare
    robot.modulator.prepare(500)
    assert robot.modulator.waiting is None


@pytest.mark.parametrize(("schedule", "slot"), [("rolling", FIRST_SLOT + 2), ("fixed", None)])
def test_a_silent_robot_speaks_from_the_next_boundary(schedule, slot):
    robot = Robot(key_of(schedule=schedule))
    robot.modulator.now = 130
    assert status(robot) == ("silence", None, True)
    answer = robot.send(number=9)
    assert (answer["tick"], answer["slot"], answer["number"], answer["replaces"]) == (240, slot, 1, None)
    assert status(robot) == ("silence", 1, True)
    robot.modulator.prepare(240)
    assert status(robot, tick=250) == (1, None, False)


def test_silence_ends_the_message_at_the_next_boundary(tmp_path):
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=(0,) * 4,
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        robot = Robot(key_of(), 7, journal)
        robot.send(number=3)
        answer = robot.control.answer({"command": "silence"})
        assert answer == {"tick": 120, "unix_s": START_UNIX_S + 2.4, "slot": FIRST_SLOT + 1, "replaces": 1}
        assert status(robot) == (0, "silence", False)
        robot.modulator.prepare(120)
        assert status(robot, tick=121) == ("silence", None, True)
        robot.modulator.now = 150
        robot.control.answer({"command": "silence"})
        assert robot.send(number=4)["replaces"] == "silence"
    assert [event.text for event in read_journal(journal.path).events][1::2] == [
        "silence begins here, in the place of message 1, which never began",
        "message 2 begins here, number 4, in the place of silence, which never began",
    ]


def status(robot: Robot, tick: int = 55):
    robot.tick = tick
    answer = robot.control.answer({"command": "status"})
    return answer["message"], answer["waiting"], answer["silent"]


def test_the_stop_is_latched_and_noted_in_the_journal(tmp_path):
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=(0,) * 4,
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        robot = Robot(key_of(), 7, journal)
        assert [robot.send(number=number)["tick"] for number in (3, 4)] == [120, 120]
        assert robot.control.answer({"command": "stop"}) == {"stopped": True}
        assert robot.guard.admit(BodyVelocity(0.1, 0.0, 0.0), 0.0, 0.0) == STOP
    events = [(event.tick, event.text) for event in read_journal(journal.path).events]
    assert events == [
        (120, "message 1 begins here, number 3"),
        (120, "message 2 begins here, number 4, in the place of message 1, which never began"),
        (55, "stop over the control socket"),
    ]


def test_the_status_says_how_the_run_fares_in_json():
    robot = Robot(key_of(), 7)
    robot.guard.admit(BodyVelocity(math.nan, 0.0, 0.0), 0.0, 0.0)
    robot.stats.sent, robot.stats.missed = 50, 2
    robot.send(number=1)
    status = json.loads(json.dumps(robot.control.answer({"command": "status"})))
    told = {name: status[name] for name in ("robot", "key", "tick", "sent", "missed", "refused", "message", "waiting")}
    assert told == {
        "robot": "robot0", "key": "fake-key", "tick": 55, "sent": 50, "missed": 2, "refused": 1, "message": 0,
        "waiting": 1,
    }  # fmt: skip
    assert (status["stopped"], status["journal_lost"]) == (False, None)
    assert status["link"] == {"up": True, "fault": None}
    assert (status["content"], status["waiting_content"]) == ("number 7", "number 1")
    assert status["state"] == "standing still without base commands"
    assert status["commands"] == {"arriving": False, "age_s": None, "sender": None, "of_others": 0, "lost": 0}


def test_the_status_says_whether_and_from_whom_commands_arrive():
    robot = Robot(key_of(), 7)
    robot.source.sender, robot.source.intrusions = "process 7", 3
    robot.guard.admit(BodyVelocity(0.1, 0.0, 0.0), 1.1, 1.1)
    status = robot.control.answer({"command": "status"})
    assert status["commands"] == {
        "arriving": True, "age_s": pytest.approx(0.01), "sender": "process 7", "of_others": 3, "lost": 0,
    }  # fmt: skip
    assert status["state"] == "driving with the message"


def test_a_stopped_robot_takes_no_message_and_says_so():
    robot = Robot(key_of(), 7)
    robot.control.answer({"command": "stop"})
    with pytest.raises(MtmError, match="stopped for good"):
        robot.send(number=1)
    assert robot.modulator.waiting is None
    assert robot.control.answer({"command": "status"})["state"] == "stopped for good"


@pytest.mark.parametrize(
    ("request_", "sentence"),
    [
        ({}, "command None is unknown"),
        ({"command": ["send"]}, "is unknown"),
        ({"command": "dance"}, "choose one of: send, silence, status, stop"),
        ({"command": "stop", "content": {}}, "unknown field 'content'"),
        ({"command": "silence", "content": {}}, "unknown field 'content'"),
        ({"command": "send"}, "no content"),
        ({"command": "send", "content": 7}, "no content"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused(request_, sentence):
    robot = Robot(key_of(), 7)
    with pytest.raises(MtmError, match=sentence):
        robot.control.answer(request_)
    assert not robot.guard.stopped
