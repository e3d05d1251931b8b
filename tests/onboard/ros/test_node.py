"""The node with a stand-in for ROS, in real time; what its runtime does is proven in simulated time beside this."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.journal.journal import read_journal
from mtm_onboard.protocol import Key, save_key
from mtm_onboard.protocol.framing import number_of_symbols
from mtm_onboard.ros.node import main
from mtm_onboard.runtime.guard import NOISE
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.ros.fake_ros import FakeRos, twist
from tests.onboard.schemes import FAKE_SECRET, small_codebook, small_scheme

SYMBOLS = (1, 3, 0, 2)
FORWARD = twist(0.3, 0.0, 0.0)


@pytest.fixture
def parameters(tmp_path):
    scheme = small_scheme()
    save_key(Key("fake-key", FAKE_SECRET, scheme), tmp_path / "r.key")
    return {
        "key": str(tmp_path / "r.key"), "channel": "a", "message": number_of_symbols(SYMBOLS, scheme), "speed_mps": 3,
        "turn_rate_radps": 2.0, "journal": str(tmp_path / "r.csv"),
        # A busy host may hold the test up for longer than a command is fresh by default.
        "noise_off_s": 5.0, "stopped_s": 6.0,
    }  # fmt: skip


@pytest.fixture
def run(monkeypatch):
    def run(parameters, script):
        ros = FakeRos(parameters, script)
        ros.install(monkeypatch)
        return main([]), ros

    return run


def end() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def commanded(ros: FakeRos, message, twists: int):
    """Fresh commands until so many twists more have come out."""
    wanted = len(ros.published) + twists
    while len(ros.published) < wanted:
        ros.command(message)
        yield


def rows(ros: FakeRos) -> np.ndarray:
    return np.array([message.six() for message in ros.published])


def test_commands_come_out_with_the_message_and_end_in_zeros(run, parameters):
    def script(ros):
        yield from commanded(ros, FORWARD, 30)
        end()

    code, ros = run(parameters, script)
    assert code == 0
    record = read_journal(Path(parameters["journal"]))
    modulator = Modulator(small_codebook(), "a", (1,))
    noisy = record.flags == NOISE
    noise = np.array([modulator.perturbation(tick) for tick in record.ticks[noisy].tolist()])
    assert np.count_nonzero(noisy) > 15
    assert (record.sent - record.base)[noisy, :2] == pytest.approx(0.1 * noise, abs=1e-6)
    assert rows(ros)[: len(record.sent), [0, 1, 5]] == pytest.approx(record.sent, abs=1e-6)
    assert not rows(ros)[-1].any()
    assert rows(ros)[-5:-3].any()
    # The topics are there until the robot has been told to stop.
    assert ros.events[0] == "initialised"
    assert ros.events[-2:] == ["destroyed", "shut down"]
    assert "ticks sent" in ros.node.infos[0]
    assert record.header.robot == "mtm"


def test_the_operator_s_stop_is_a_service_and_holds(run, parameters):
    answers = []

    def script(ros):
        yield from commanded(ros, FORWARD, 15)
        answers.append(ros.call_stop())
        yield from commanded(ros, FORWARD, 2)
        answers.append(len(ros.published))
        yield from commanded(ros, FORWARD, 15)
        end()

    code, ros = run(parameters, script)
    answer, stopped = answers
    assert (code, answer.success) == (0, True)
    assert "stands still" in answer.message
    assert rows(ros)[:stopped].any()
    assert not rows(ros)[stopped:].any()


def test_without_a_message_commands_pass_as_they_are(run, parameters):
    def script(ros):
        yield from commanded(ros, FORWARD, 20)
        end()

    del parameters["message"]
    code, ros = run(parameters, script)
    assert code == 0
    assert {tuple(row) for row in rows(ros)[:-3]} <= {(0.0,) * 6, (0.3, 0.0, 0.0, 0.0, 0.0, 0.0)}
    assert rows(ros).any()


def test_a_command_that_comes_no_more_is_stopped_for(run, parameters):
    def script(ros):
        yield from commanded(ros, FORWARD, 15)
        wanted = len(ros.published) + 30
        while len(ros.published) < wanted:
            yield
        end()

    code, ros = run(parameters | {"noise_off_s": 0.1, "stopped_s": 0.25}, script)
    assert code == 0
    assert rows(ros)[:15].any()
    assert not rows(ros)[-12:].any()


def test_when_ros_fails_the_robot_is_told_to_stop(run, parameters):
    def script(ros):
        yield from commanded(ros, FORWARD, 15)
        raise RuntimeError("the middleware is gone")

    code, ros = run(parameters, script)
    assert code == 1
    assert "the middleware is gone" in ros.node.errors[0]
    assert not rows(ros)[-1].any()
    assert ros.events[-2:] == ["destroyed", "shut down"]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"key": ""}, "names no file"),
        ({"key": "/nowhere/r.key"}, "/nowhere/r.key"),
        ({"channel": ""}, "no channel ''"),
        ({"speed_mps": 0.0}, "speed_mps"),
        ({"message": 10**9}, "does not fit"),
        ({"message": -1, "text": "hi"}, "plain numbers"),
    ],
)
def test_what_does_not_fit_is_told_before_publishing(run, parameters, changes, says):
    code, ros = run(parameters | changes, lambda ros: iter(()))
    assert code == 1
    assert len(ros.node.errors) == 1
    assert says in ros.node.errors[0]
    assert ros.published == []


def test_without_ros_the_node_says_what_to_source(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main([]) == 1
    assert "source its setup file first" in capsys.readouterr().err
