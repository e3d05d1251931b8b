"""What a run tells its operator."""

import math
import threading
from dataclasses import replace

import pytest

from mtm_onboard.control.state_log import RunState, StateLog, changes, named
from mtm_onboard.protocol import Key
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.runtime.message import SILENCE, message_of
from tests.onboard.schemes import FAKE_SECRET, small_scheme

CALM = RunState(
    stopped_by="", link_up=True, link_fault="", link_doubt="", command_age_s=0.01, stale=False, sender="process 7",
    intruder="", message="message 0, number 178", waiting=None, sends=True,
)  # fmt: skip
STOPPED = replace(CALM, stopped_by="the operator said stop")


def told(before: RunState | None, **now: object) -> list[str]:
    return list(changes(before, replace(CALM, **now)))


@pytest.mark.parametrize(
    ("now", "says"),
    [
        ({}, []),
        ({"stopped_by": "the operator said stop"},
         ["the operator said stop: the robot stands still until the run is started anew"]),
        ({"link_up": False, "link_fault": "cable pulled"}, ["the link is down (cable pulled)"]),
        ({"link_doubt": "no telemetry"}, ["the link is degraded: no telemetry"]),
        ({"stale": True, "command_age_s": 0.3},
         ["base commands have stopped coming: no noise, and the robot stands still"]),
        ({"sender": "process 9"}, ["base commands now come from process 9"]),
        ({"intruder": "process 9"},
         ["process 9 sends base commands as well; they are refused as long as process 7 sends"]),
        ({"waiting": "silence"}, ["silence waits for the next boundary"]),
        ({"message": "message 1, text 'hi'"}, ["message 1, text 'hi' begins"]),
        ({"message": "silence", "sends": False}, ["silence begins"]),
        ({"sends": False}, ["the message has ended"]),
    ],
)  # fmt: skip
def test_each_change_of_state_is_one_sentence(now, says):
    assert told(CALM, **now) == says


@pytest.mark.parametrize(
    ("before", "says"),
    [
        ({"stale": True}, ["base commands come from process 7"]),
        ({"link_up": False}, ["the link is up"]),
        ({"link_doubt": "no telemetry"}, ["the link is no longer degraded"]),
        ({"sends": False}, ["message 0, number 178 begins"]),
        ({"stopped_by": "the operator said stop"}, []),
    ],
)
def test_what_is_well_again_is_told_as_well(before, says):
    assert told(replace(CALM, **before)) == says


def test_at_first_the_link_and_the_base_commands_are_told():
    assert told(None) == ["the link is up", "base commands come from process 7"]
    assert told(None, stale=True, command_age_s=math.inf) == [
        "the link is up", "no base command has come yet: the robot stands still",
    ]  # fmt: skip


def test_a_stopped_robot_s_base_commands_are_no_news():
    assert list(changes(STOPPED, replace(STOPPED, stale=True))) == []


def test_the_worst_of_a_state_comes_first_in_its_summary():
    assert replace(STOPPED, link_up=False).summary == "stopped for good"
    assert replace(CALM, link_up=False, stale=True).summary == "the link is down"
    assert replace(CALM, stale=True).summary == "standing still without base commands"
    assert (CALM.summary, replace(CALM, sends=False).summary) == (
        "driving with the message",
        "driving without a message",
    )


def test_messages_are_named_by_what_they_say():
    plain = Key("fake-key", FAKE_SECRET, small_scheme())
    framed = Key("fake-key", FAKE_SECRET, small_scheme(message_ticks=480, framing=Framing("integer", 6)))
    assert named(message_of(178, plain)) == "message 0, number 178"
    assert named(message_of((1, 3, 0, 2), plain, 4)) == "message 4, symbols 1,3,0,2"
    assert named(message_of(13, framed, 2)) == "message 2, number 13"
    assert (named(SILENCE), named(None), named((1, 2))) == ("silence", None, None)


def test_a_reader_that_is_gone_or_stuck_holds_up_nobody(monkeypatch):
    monkeypatch.setattr("mtm_onboard.control.state_log._LONGEST_FAREWELL_S", 0.05)
    stuck = threading.Event()

    def gone(sentence: str) -> None:
        raise BrokenPipeError

    with StateLog(lambda: CALM, gone):
        pass
    with StateLog(lambda: CALM, lambda sentence: stuck.wait(20.0)):
        pass
    stuck.set()


def test_a_log_says_what_changes_while_it_runs(monkeypatch):
    monkeypatch.setattr("mtm_onboard.control.state_log._PERIOD_S", 0.001)
    states = iter([CALM, CALM, STOPPED])
    said: list[str] = []
    heard = threading.Event()

    def say(sentence: str) -> None:
        said.append(sentence)
        if "stands still" in sentence:
            heard.set()

    with StateLog(lambda: next(states, STOPPED), say):
        assert heard.wait(20.0)
    assert said == [
        "the link is up", "base commands come from process 7",
        "the operator said stop: the robot stands still until the run is started anew",
    ]  # fmt: skip
