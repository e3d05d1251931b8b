import re
import sys
from pathlib import Path

import pytest

from mtm_onboard.protocol import MtmError
from mtm_onboard.ros.node import main
from mtm_onboard.ros.parameters import DEFAULTS, config_of, key_path, plan_of
from mtm_onboard.runtime.config import ControlSettings, JournalSettings, Robot
from mtm_onboard.runtime.guard import Limits, Staleness

PAGE = (Path(__file__).parents[3] / "docs" / "policies-and-ros2.md").read_text()
GIVEN = DEFAULTS | {"key": "/etc/mtm/r.key", "channel": "a", "speed_mps": 1, "turn_rate_radps": 2.5}


def test_parameters_become_a_configuration():
    config = config_of(GIVEN | {"journal": "j.csv", "socket": "/run/mtm/r.sock", "noise_off_s": 0.15}, "robot0")
    assert config.robot == Robot("robot0", "a")
    assert (config.limits, config.staleness) == (Limits(1, 2.5), Staleness(0.15, 0.25))
    assert (config.journal, config.control) == (JournalSettings("j.csv"), ControlSettings("/run/mtm/r.sock"))
    assert key_path(GIVEN) == Path("/etc/mtm/r.key")


def test_without_a_journal_and_a_socket_there_is_none():
    config = config_of(GIVEN, "robot0")
    assert (config.journal, config.control) == (None, None)


@pytest.mark.parametrize(
    ("changes", "content"),
    [({}, None), ({"message": 0}, 0), ({"message": 178}, 178), ({"text": "hi"}, "hi")],
)
def test_a_message_is_a_number_or_a_text_or_none(changes, content):
    assert plan_of(GIVEN | changes).message == content


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"message": 1, "text": "hi"}, "one of the two"),
        ({"message": True}, "whole number"),
        ({"message": 1.5}, "whole number"),
        ({"text": 178}, "in quotes"),
    ],
)
def test_any_other_message_is_refused(changes, says):
    with pytest.raises(MtmError, match=says):
        plan_of(GIVEN | changes)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"speed_mps": 0.0}, "speed_mps is 0.0"),
        ({"turn_rate_radps": "fast"}, "give a number"),
        ({"noise_off_s": 0.3}, "noise off before the stop"),
        ({"channel": 3}, "text in quotes"),
        ({"journal": 3}, "text in quotes"),
    ],
)
def test_a_value_that_no_configuration_may_have_is_refused(changes, says):
    with pytest.raises(MtmError, match=f"a parameter is wrong: .*{says}"):
        config_of(GIVEN | changes, "robot0")


@pytest.mark.parametrize("key", ["", 7])
def test_without_a_key_file_there_is_nothing_to_run(key):
    with pytest.raises(MtmError, match="names no file"):
        key_path(GIVEN | {"key": key})


def test_the_documented_parameters_are_those_there_are():
    rows = [line for line in PAGE.splitlines() if line.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`([^`]+)`", row.split("|")[1])}
    assert named == DEFAULTS.keys() | {"cmd_vel", "cmd_vel_out", "~/stop"}
    for name in ("noise_off_s", "stopped_s"):
        assert f"`{name}` ({DEFAULTS[name]})" in PAGE


def test_a_state_file_and_the_lab_s_clock_are_passed_on():
    config = config_of(GIVEN | {"state": "r.state"}, "robot0")
    assert (config.state.path, str(config.ledger_path)) == ("r.state", "r.state")
    assert plan_of(GIVEN | {"allow_unsynchronised": True}).allow_unsynchronised
    with pytest.raises(MtmError, match="true or false"):
        plan_of(GIVEN | {"allow_unsynchronised": 1})


def test_without_ros_the_node_says_what_to_source(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main([]) == 1
    assert "source its setup file first" in capsys.readouterr().err
