import numpy as np
import pytest

from hil.cli import main
from hil.experiments.runs.fingerprint import code_fingerprint
from hil.plants.plant_file import load_plant
from mtm_audit.detectors.matched.profile import load_profile
from tests.hil.experiments.identify.logged_robot import write_mrclam


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    return [*write_mrclam(folder), *write_mrclam(folder, "Robot2", seed=2)]


def test_two_robots_become_a_plant_a_profile_and_a_table(tmp_path, logs, capsys):
    plant, profile, out = tmp_path / "rover.toml", tmp_path / "rover_profile.toml", tmp_path / "a.csv"
    given = ["--plant", plant, "--profile", profile, "--out", out, "--summary", "rover", "--source", "made up"]
    assert run("identify", *logs, *given) == 0
    found = load_plant(plant)
    assert (found.summary, found.source, found.axes) == ("rover", "made up", ("vx", "wz"))
    assert [robot.source for robot in found.robots] == ["Robot1_Odometry", "Robot2_Odometry"]
    assert [robot.axes["vx"].response.delay_s for robot in found.robots] == pytest.approx([0.2, 0.2], abs=0.04)
    comments = [line for line in plant.read_text().splitlines() if line.startswith("# ")]
    assert comments[0].startswith("# mtm-hil identify Robot1_Odometry.dat Robot1_Groundtruth.dat Robot2_Odometry.dat")
    assert comments[1] == f"# code {code_fingerprint()}"
    assert comments[2].startswith("# vx: at 0.5, 1, 2, 3 Hz gain ")
    rows = [line.split(",") for line in out.read_text().splitlines() if not line.startswith("#")]
    assert [row[:2] for row in rows[1:]] == [["Robot1_Odometry", "vx"], ["Robot1_Odometry", "wz"],
                                             ["Robot2_Odometry", "vx"], ["Robot2_Odometry", "wz"]]  # fmt: skip
    learnt = load_profile(profile)
    assert learnt.weights.sum() == pytest.approx(1.0)
    assert [axis.name for axis in learnt.axes] == ["vx", "wz"]
    assert f"use it with mtm-hil bench --plants {plant}" in capsys.readouterr().out


def test_an_identified_robot_is_benched_and_recorded(tmp_path, logs):
    plant = tmp_path / "rover.toml"
    assert run("identify", *logs[:2], "--plant", plant) == 0
    assert run("bench", "--plants", plant, "--rollouts", 1, "--ticks", 60, "--cells", tmp_path / "cells.jsonl",
               "--out", tmp_path / "a.csv") == 0  # fmt: skip
    assert "\nrover.toml,vx wz,16,60" in (tmp_path / "a.csv").read_text()
    assert run("record", "--seconds", 3, "--wire", "direct", "--plant", plant, "--no-video", "--message", 1,
               "--out", tmp_path / "a") == 0  # fmt: skip
    assert len(list((tmp_path / "a" / "mocap").iterdir())) == 4


def test_a_file_too_few_gets_one_sentence(logs, capfd):
    assert run("identify", *logs[:3]) == 1
    assert "name two files for each robot: its commands, then how it moved" in capfd.readouterr().err


def test_commands_that_never_change_get_one_sentence(tmp_path, logs, capfd):
    table = np.loadtxt(logs[0])
    table[:, 1:] = [0.3, 0.0]
    np.savetxt(tmp_path / "a.dat", table)
    assert run("identify", tmp_path / "a.dat", logs[1], "--plant", tmp_path / "a.toml") == 1
    error = capfd.readouterr().err
    assert "the commands never change" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a.toml").exists()


def test_commands_that_answer_the_motion_are_mentioned(logs, capsys):
    assert run("identify", *logs[:2], "--offset", 0.6) == 0
    assert "Robot1_Odometry, vx: the motion comes before its commands" in capsys.readouterr().out
    assert run("identify", *logs[:2]) == 0
    assert "comes before" not in capsys.readouterr().out
