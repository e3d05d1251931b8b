"""Our node on a real ROS 2, in real time; what its runtime does is proven in simulated time elsewhere."""

import json
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.journal.journal import read_journal
from mtm_onboard.protocol import Key, load_key, save_key
from mtm_onboard.protocol.framing import number_of_symbols
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.runtime.guard import NOISE, STALE
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import FAKE_SECRET, small_codebook, small_scheme
from tests.peers.conftest import ROOT, Process, installed, until

pytestmark = pytest.mark.peer

HERE = ROOT / "tests/peers/ros"
SYMBOLS = (1, 3, 0, 2)
ALONE = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
    "RCUTILS_LOGGING_USE_STDOUT": "1",
    # Cyclone DDS would take the network's interface and find its peers by multicast.
    "CYCLONEDDS_URI": '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/>'
    "</Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40"
    '</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>',
}  # fmt: skip


class Node:
    """Our node, which is under way, and the peer that drives it."""

    def __init__(self, start, tmp_path, *peer: object, **parameters: object) -> None:
        python = installed("ros")
        scheme = small_scheme()
        self.journal_path = tmp_path / "r.csv"
        if not (tmp_path / "r.key").exists():
            save_key(Key("fake-key", FAKE_SECRET, scheme), tmp_path / "r.key")
        values = {
            "key": tmp_path / "r.key", "channel": "a", "message": number_of_symbols(SYMBOLS, scheme), "speed_mps": 3,
            "turn_rate_radps": 2.0, "journal": self.journal_path,
            # A busy host may hold the peer up for longer than a command is fresh by default.
            "noise_off_s": 1.0, "stopped_s": 2.0,
        }  # fmt: skip
        arguments = [f"{name}:={value}" for name, value in (values | parameters).items()]
        given = [part for argument in arguments for part in ("-p", argument)]
        environment = ALONE | {"ROS_LOG_DIR": str(tmp_path)}
        self.node: Process = start(
            python, "-m", "mtm_onboard.ros", "--ros-args", "-r", "__node:=robot0", *given, **environment
        )
        script = "dds_peer.py" if peer and peer[0] == "dds" else "ros_peer.py"
        given = [ALONE["ROS_DOMAIN_ID"]] if script == "dds_peer.py" else list(peer)
        self.peer: Process | None = start(python, HERE / script, *given, **environment) if peer else None

    def heard(self) -> list[dict]:
        return [json.loads(line) for line in list(self.peer.lines) if line.startswith('{"t"')]

    def moving(self, twists: int, seconds: float = 40.0) -> None:
        """Wait until so many twists have come out that are not zero."""
        assert until(lambda: sum(any(each["twist"]) for each in self.heard()) >= twists, seconds), self.node.output

    def interrupt(self) -> int:
        self.node.signal(signal.SIGINT)
        code = self.node.end()
        # Until what was published last has been heard.
        until(lambda: not self.heard() or not any(self.heard()[-1]["twist"]), 5.0)
        return code


@pytest.mark.parametrize("reliability", ["reliable", "best_effort"])
def test_commands_of_either_reliability_get_the_message(start, tmp_path, reliability):
    driven = Node(start, tmp_path, "--reliability", reliability)
    driven.moving(300)
    assert driven.interrupt() == 0
    record = with_noise(read_journal(driven.journal_path), load_key(tmp_path / "r.key"))
    noisy = record.flags & NOISE > 0
    first = int(np.argmax(noisy))
    assert np.mean(noisy[first:]) > 0.9
    modulator = Modulator(small_codebook(), "a", (1,))
    noise = np.array([modulator.perturbation(tick) for tick in record.ticks[noisy].tolist()])
    assert (record.sent - record.base)[noisy, :2] == pytest.approx(0.1 * noise, abs=1e-6)
    assert record.base[noisy][-1] == pytest.approx([0.3, 0.0, 0.0])


def test_another_middleware_drives_it_and_hears_it(start, tmp_path):
    driven = Node(start, tmp_path, "dds")
    driven.moving(200)
    driven.node.signal(signal.SIGINT)
    assert driven.node.end() == 0
    record = with_noise(read_journal(driven.journal_path), load_key(tmp_path / "r.key"))
    noisy = record.flags & NOISE > 0
    assert np.mean(noisy[int(np.argmax(noisy)) :]) > 0.9
    sent = {tuple(np.round(row, 6)) for row in record.sent}
    heard = {tuple(np.round(np.array(each["twist"])[[0, 1, 5]], 6)) for each in driven.heard()}
    assert heard <= sent | {(0.0, 0.0, 0.0)}


def test_what_comes_out_has_the_key_s_rate_and_the_noise_s_sigma(start, tmp_path):
    driven = Node(start, tmp_path, "--reliability", "best_effort", noise_off_s=5.0, stopped_s=6.0)
    driven.moving(400)
    assert driven.interrupt() == 0
    heard = [each for each in driven.heard() if any(each["twist"])][20:]
    times_s = np.array([each["t"] for each in heard])
    twists = np.array([each["twist"] for each in heard])
    assert (len(times_s) - 1) / (times_s[-1] - times_s[0]) == pytest.approx(50.0, rel=0.02)
    whole = twists[: len(twists) // 120 * 120]
    assert whole[:, :2].mean(axis=0) == pytest.approx([0.3, 0.0], abs=0.01)
    # Windows with a mean square of one, times sigma.
    assert whole[:, :2].std(axis=0) == pytest.approx([0.1, 0.1], rel=0.1)
    assert not whole[:, 2:].any()


def test_the_operator_s_stop_is_a_service_and_holds(start, tmp_path):
    driven = Node(start, tmp_path, "--reliability", "reliable")
    driven.moving(50)
    driven.peer.say("stop")
    success, message = json.loads(driven.peer.wait_for('{"stop"'))["stop"]
    assert success
    assert "stands still" in message
    time.sleep(1.0)
    since = len(driven.heard())
    assert until(lambda: len(driven.heard()) >= since + 50, 20.0)
    assert not np.array([each["twist"] for each in driven.heard()[since:]]).any()
    driven.node.wait_for("the operator said stop: the robot stands still")
    assert driven.interrupt() == 0


def test_commands_that_come_no_more_are_stopped_for_and_told(start, tmp_path):
    driven = Node(start, tmp_path, "--reliability", "reliable", noise_off_s=0.3, stopped_s=0.5)
    driven.moving(50)
    driven.peer.say("quiet")
    driven.node.wait_for("base commands have stopped coming")
    # That is said when the noise goes; the robot stops later.
    assert until(lambda: not any(driven.heard()[-1]["twist"]), 20.0)
    assert driven.interrupt() == 0
    assert read_journal(driven.journal_path).flags[-1] == STALE
    assert not any(driven.heard()[-1]["twist"])


def test_an_interrupt_leaves_a_twist_of_zeros_behind_and_sums_up(start, tmp_path):
    driven = Node(start, tmp_path, "--reliability", "reliable")
    driven.moving(50)
    assert driven.interrupt() == 0
    assert not any(driven.heard()[-1]["twist"])
    assert "ticks sent" in driven.node.output
    assert "Traceback" not in driven.node.output


def test_at_its_start_the_node_says_what_it_is(start, tmp_path):
    driven = Node(start, tmp_path, "--reliability", "reliable")
    driven.moving(5)
    assert driven.interrupt() == 0
    for words in (
        "robot0 plays channel a", "base commands come from the topic /cmd_vel and go to the topic /cmd_vel_out",
        "call the service /robot0/stop", "base commands come",
    ):  # fmt: skip
        assert words in driven.node.output


@pytest.mark.parametrize("delay_s", [0.0, 0.2, 0.4, 0.8])
def test_an_interrupt_in_the_first_second_is_no_traceback(start, tmp_path, delay_s):
    driven = Node(start, tmp_path)
    # Before the interpreter has come up and begun to load ours, no program can answer for it.
    assert until(lambda: "_multiarray_umath" in memory_map(driven.node), 20.0)
    time.sleep(delay_s)
    driven.node.signal(signal.SIGINT)
    assert driven.node.end() in (0, 130)
    assert "Traceback" not in driven.node.output


def memory_map(process: Process) -> str:
    return Path(f"/proc/{process.pid}/maps").read_text()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"key": "''"}, "names no file"), ({"key": "/nowhere/r.key"}, "/nowhere/r.key"),
        ({"channel": "''"}, "no channel ''"),
        ({"speed_mps": 0.0}, "speed_mps"), ({"message": 10**9}, "does not fit"),
        ({"message": -1, "text": "hi"}, "plain numbers"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_told_in_one_sentence(start, tmp_path, changes, says):
    driven = Node(start, tmp_path, **changes)
    assert driven.node.end() == 1
    assert len([line for line in driven.node.lines if "ERROR" in line]) == 1
    assert says in driven.node.output
    assert "Traceback" not in driven.node.output
    assert not driven.journal_path.exists()


def test_arguments_that_ros_does_not_know_are_one_sentence(start, tmp_path):
    python = installed("ros")
    node = start(python, "-m", "mtm_onboard.ros", "--ros-args", "--nonsense", **ALONE | {"ROS_LOG_DIR": str(tmp_path)})
    assert node.end() == 1
    assert "correct its arguments" in node.output
    assert "Traceback" not in node.output


@pytest.mark.parametrize("speed_up", [1.0, 3.0])
def test_under_simulated_time_ticks_follow_that_time(start, tmp_path, speed_up):
    driven = Node(
        start, tmp_path, "--clock-hz", 200, "--speed-up", speed_up, "--rate", 50 * speed_up, use_sim_time="true"
    )
    driven.moving(round(250 * speed_up))
    assert driven.interrupt() == 0
    heard = [each for each in driven.heard() if any(each["twist"])][20:]
    times_s = np.array([each["ros"] for each in heard])
    record = read_journal(driven.journal_path)
    ticks, seconds = record.ticks[-1] - record.ticks[20], record.times_s[-1] - record.times_s[20]
    assert ticks / seconds == pytest.approx(50.0, rel=0.02)
    # A busy host misses ticks, which have no rows and no twists.
    sent_hz = (len(record.ticks) - 21) / seconds
    assert (len(times_s) - 1) / (times_s[-1] - times_s[0]) == pytest.approx(sent_hz, rel=0.1)
    # Three times as fast, a busy host may publish too rarely.
    assert speed_up > 1.0 or "/clock advances" not in driven.node.output


def test_too_coarse_a_clock_is_told_once_and_shifts_no_tick(start, tmp_path):
    driven = Node(start, tmp_path, "--clock-hz", 10, use_sim_time="true")
    driven.moving(40)
    assert driven.interrupt() == 0
    warnings = [line for line in driven.node.lines if "/clock advances" in line]
    assert len(warnings) == 1
    assert "50 Hz or more" in warnings[0]
    record = read_journal(driven.journal_path)
    # Five ticks of 20 ms to each step of 100 ms.
    assert np.median(np.diff(record.ticks)) == 5
    assert record.times_s - record.header.start_s == pytest.approx(record.ticks / 50.0, abs=0.021)


def test_a_clock_that_goes_back_stops_the_robot(start, tmp_path):
    driven = Node(start, tmp_path, "--clock-hz", 100, use_sim_time="true")
    driven.moving(50)
    driven.peer.say("back")
    assert driven.node.end() == 1
    (error,) = [line for line in driven.node.lines if "ERROR" in line]
    assert "/clock went back by" in error
    assert until(lambda: not any(driven.heard()[-1]["twist"]), 5.0)


def test_without_a_clock_the_node_waits_and_can_be_ended(start, tmp_path):
    driven = Node(start, tmp_path, use_sim_time="true")
    driven.node.wait_for("until /clock is published")
    driven.node.signal(signal.SIGINT)
    assert driven.node.end() == 0
    assert not driven.journal_path.exists() or not len(read_journal(driven.journal_path).ticks)
