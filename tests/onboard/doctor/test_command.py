import json
from pathlib import Path

import pytest

from mtm_onboard.cli import main
from mtm_onboard.doctor.finding import Finding, worst
from mtm_onboard.links.none import NullLink

CONFIG = """
[robot]
name = "robot0"
channel = "{channel}"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
kind = "stdin"
[journal]
path = "{journal}"
"""
DOCUMENT = Path(__file__).parents[3] / "docs" / "doctor.md"
CHECKS = [
    "configuration", "key", "grant", "fit", "link", "source", "control", "journal", "state", "clock", "processors",
    "realtime", "loop",
]  # fmt: skip


@pytest.fixture
def robot(tmp_path, monkeypatch):
    """The folder of a robot that is in order, on a computer that is."""
    tmp_path.chmod(0o700)
    monkeypatch.setattr("mtm_onboard.doctor.examination.is_synchronised", lambda: True)
    monkeypatch.setattr("mtm_onboard.doctor.examination.check_loop", watched)
    assert (
        main(["keygen", "--id", "fake-key", "--out", str(tmp_path / "robot.key"), "--preset", "paper-robomaster-fleet"])
        == 0
    )
    configure(tmp_path)
    return tmp_path


def configure(folder: Path, channel: str = "robot0") -> None:
    (folder / "robot.toml").write_text(CONFIG.format(channel=channel, journal=folder / "robot.csv"))


def watched(settings, scheme, duration_s):
    return [Finding("realtime", "pass", "granted"), Finding("loop", "pass", "on time", {"seconds": duration_s})]


def doctor(folder: Path, *options: str) -> int:
    return main(["doctor", "--config", str(folder / "robot.toml"), "--key", str(folder / "robot.key"), *options])


def test_a_robot_in_order_passes_line_by_line(robot, capsys):
    capsys.readouterr()
    assert doctor(robot) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == CHECKS
    assert {line.split()[0] for line in lines} <= {"pass", "warn"}
    assert sorted(path.name for path in robot.iterdir()) == ["robot.key", "robot.toml"]


def test_nothing_is_opened_that_could_move_the_robot(robot, monkeypatch):
    for name in ("open", "resume", "send", "service", "stop"):
        monkeypatch.setattr(NullLink, name, lambda *_: pytest.fail("the link was touched"))
    assert doctor(robot) == 0


def test_the_json_is_as_documented(robot, capsys):
    capsys.readouterr()
    assert doctor(robot, "--json", "--seconds", "3") == 0
    table = json.loads(capsys.readouterr().out)
    assert set(table) == {"format", "status", "checks"}
    assert table["format"] == 1
    assert table["status"] in ("pass", "warn")
    assert [check["check"] for check in table["checks"]] == CHECKS
    assert all(set(check) == {"check", "status", "text", "figures"} for check in table["checks"])
    assert table["checks"][-1]["figures"] == {"seconds": 3.0}
    text = DOCUMENT.read_text(encoding="utf-8")
    assert all(f"`{check}`" in text for check in CHECKS)


def test_one_failure_is_the_exit_code(robot, capsys):
    configure(robot, channel="robot9")
    assert doctor(robot) == 1
    assert "fail  fit" in capsys.readouterr().out


def test_a_warning_is_not(robot, monkeypatch):
    monkeypatch.setattr("mtm_onboard.doctor.examination.is_synchronised", lambda: False)
    assert doctor(robot) == 0


def test_a_key_that_others_can_read_is_never_shown(robot, capsys):
    (robot / "robot.key").chmod(0o644)
    secret = (robot / "robot.key").read_text().split('secret = "')[1][:64]
    assert doctor(robot, "--json") == 1
    shown = capsys.readouterr().out
    assert "chmod 600" in shown
    assert secret not in shown


def test_without_configuration_or_key_both_are_told(tmp_path, capsys):
    assert doctor(tmp_path) == 1
    assert [line.split()[:2] for line in capsys.readouterr().out.splitlines()] == [
        ["fail", "configuration"], ["fail", "key"],
    ]  # fmt: skip


@pytest.mark.parametrize("seconds", ["0", "nan", "-1", "1e9", "x"])
def test_a_time_that_makes_no_sense_is_refused(robot, seconds):
    with pytest.raises(SystemExit) as caught:
        doctor(robot, "--seconds", seconds)
    assert caught.value.code == 2


def test_the_worst_finding_counts():
    found = [Finding("a", status, "x") for status in ("pass", "fail", "warn")]
    assert worst(found) == "fail"
    assert worst(found[::2]) == "warn"
    assert worst([]) == "pass"
