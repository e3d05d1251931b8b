"""`mtm-hil record` plays every scheme that a key can hold, and what it recorded is read again."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from hil.cli import main
from hil.worlds.robomaster import MOST_ROBOTS, random_permutation, routes
from mtm_audit.cli import main as audit
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.readers.video.header import inspect_video
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import load_key

RECORDING = Path("rec")
MOCAP = RECORDING / "mocap"
QUICK = ("--wire", "direct", "--no-video")
PLAIN = ("--name", "lab", "--rate", "50", "--band", "0.5:5", "--alphabet", "16", "--message-ticks", "400")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def record(*arguments):
    with pytest.raises(SystemExit) as left:
        main(["record", "--out", "rec", *map(str, arguments)])
    return left.value.code


def key(*options, name="lab.key"):
    assert onboard(["keygen", "--id", "fake", "--out", name, *map(str, options)]) == 0
    return name


def issue(holder, *, out):
    assert onboard(["issue", "--master", "lab.key", *holder, "--out", out]) == 0
    return out


def decoded(capsys, key_file="rec/robot.key", *options):
    """What an auditor reads of the motion capture, told when the recording began as `record` says."""
    told = re.search(r"decode it with (.*)", capsys.readouterr().out)
    with pytest.raises(SystemExit) as left:
        audit(["decode", "rec", "--key", key_file, "--json", *(told[1].split() if told else ()), *options])
    found = json.loads(capsys.readouterr().out)
    return left.value.code, found


@pytest.mark.parametrize("robots", [1, pytest.param(10, marks=pytest.mark.long)])
def test_one_robot_or_ten_send_a_message(robots, capsys):
    assert record("--message", 178, "--robots", robots, *QUICK) == 0
    assert len(list(MOCAP.iterdir())) == robots
    code, found = decoded(capsys)
    assert (code, found["message"]) == (0, 178)


@pytest.mark.long
def test_a_key_is_made_for_text(capsys):
    assert record("--text", "gate 4", *QUICK) == 0
    code, found = decoded(capsys)
    assert code == 0
    assert "gate 4" in json.dumps(found)


def test_a_key_is_made_for_bytes():
    assert record("--hex", "00ff", "--seconds", 3, *QUICK) == 0
    framing = load_key(RECORDING / "robot.key").scheme.framing
    assert (framing.payload, framing.payload_bits, framing.check) == ("bytes", 64, "tag")
    assert json.loads((RECORDING / "truth.json").read_text())["message"] == "00ff"


def test_a_robot_s_and_an_auditor_s_file_play_and_read(capsys):
    key("--preset", "robomaster-fleet")
    issue(("--auditor",), out="auditor.key")
    issue([f"--channel=robot{number}" for number in range(4)], out="robots.key")
    assert record("--message", 9, "--key", "robots.key", *QUICK) == 0
    code, found = decoded(capsys, "auditor.key")
    assert (code, found["message"]) == (0, 9)


def test_what_a_key_does_not_hold_is_not_sent_and_told(capsys):
    key("--preset", "robomaster-fleet")
    issue(("--channel=robot2",), out="one.key")
    assert record("--message", 9, "--key", "one.key", "--seconds", 3, *QUICK) == 0
    assert "the key does not hold robot0, robot1, robot3, whose part is not sent" in capsys.readouterr().out
    assert json.loads((RECORDING / "truth.json").read_text())["message"] == 9


def test_two_channels_of_one_body_are_played_together(capsys):
    two = ("--channel", "along:vx:4:0.2:rover", "--channel", "across:vy:2:0.2:rover")
    key(*PLAIN[:-1], 1600, *two, "--schedule", "fixed")
    assert record("--message", 70_000, "--key", "lab.key", *QUICK) == 0
    code, found = decoded(capsys, "lab.key", "--onset", "1.5")
    assert (code, found["message"]) == (0, 70_000)


def test_robots_beyond_the_key_s_bodies_send_nothing(capsys):
    key(*PLAIN, "--channel", "rover:vx,vy:4:0.1", "--schedule", "fixed")
    assert record("--message", 7, "--key", "lab.key", "--robots", 3, *QUICK) == 0
    assert sorted(path.stem for path in MOCAP.iterdir()) == ["robot0", "robot1", "rover"]
    code, found = decoded(capsys, "lab.key", "--onset", "1.5")
    assert (code, found["message"]) == (0, 7)


def test_a_recording_lasts_as_long_as_its_message():
    key(*PLAIN[:-2], "--message-ticks", 2000, "--channel", "rover:vx,vy:10:0.1", "--schedule", "fixed")
    assert record("--message", 7, "--key", "lab.key", *QUICK) == 0
    track = read_log(MOCAP / "rover.tum").tracks[0]
    assert track.times_s[-1] == pytest.approx(42.0, abs=0.02)


def test_a_film_says_when_it_was_made():
    assert record("--message", 1, "--seconds", 2, "--wire", "direct") == 0
    truth = json.loads((RECORDING / "truth.json").read_text())
    created = inspect_video(RECORDING / "video.mp4").created_unix_s
    assert created == pytest.approx(truth["unix_s"], abs=1.0)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--message", 1, "--robots", 13), 2, "it holds 12"),
        (("--message", 1, "--robots", 2, "--key", "lab.key"), 1, "give --robots 4 or more"),
        (("--text", "hi", "--key", "lab.key"), 1, "number"),
        (("--hex", "0", "--key", "lab.key"), 2, "two hexadecimal digits"),
        (("--message", 1, "--text", "x"), 2, "give one of --message N, --text TEXT, --hex HEX and --no-message"),
        (("--key", "lab.key"), 2, "give one of --message N"),
    ],
)
def test_what_cannot_be_played_is_refused(folder, capsys, arguments, code, words):
    key("--preset", "paper-robomaster-fleet")
    capsys.readouterr()
    assert record(*arguments, *QUICK) == code
    assert words in capsys.readouterr().err
    assert not (folder / "rec").exists()


def test_routes_of_many_robots_stay_apart_and_inside():
    for robots in range(1, MOST_ROBOTS + 1):
        own = routes(random_permutation(np.random.default_rng(robots), robots))
        points = np.array([(route.start_xy_m, *route.points_xy_m) for route in own])
        assert np.abs(points).max() < 2.2
        for place in range(points.shape[1]):
            apart = np.linalg.norm(points[:, None, place] - points[None, :, place], axis=-1)
            assert apart[~np.eye(robots, dtype=bool)].min(initial=9.0) > 0.4
