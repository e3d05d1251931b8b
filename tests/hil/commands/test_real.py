import numpy as np
import pytest

from hil.cli import main
from hil.experiments.runs.fingerprint import code_fingerprint
from tests.hil.experiments.real.test_rollout import spinning_track, written


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


def quick(tmp_path, *more):
    return ["real", tmp_path / "tracks", "-n", 1, "--window", 2, "--seconds", 12, "--workers", 1, "--out",
            tmp_path / "a.csv", "--cells", tmp_path / "cells.jsonl", *more]  # fmt: skip


@pytest.fixture
def tracks(tmp_path):
    (tmp_path / "tracks").mkdir()
    written(tmp_path / "tracks", spinning_track(14.0))
    return tmp_path / "tracks"


def test_a_folder_is_measured_in_both_frames(tmp_path, tracks, capsys):
    assert run(*quick(tmp_path)) == 0
    first, second, *rest = (tmp_path / "a.csv").read_text().splitlines()
    assert first.startswith("# mtm-hil real tracks -n 1 --frame world --frame body --sigma 0.1 --alphabet 8")
    assert second == f"# code {code_fingerprint()}"
    rows = [line.split(",") for line in rest if not line.startswith("#")]
    assert [row[:4] for row in rows[1:]] == [["robot", "world", "0.1", "800000"], ["robot", "body", "0.1", "800000"]]
    assert "windows right, onset known, % of" in capsys.readouterr().out


def test_a_track_without_heading_is_left_out_in_the_body_frame(tmp_path, tracks, capsys):
    track = spinning_track(14.0)
    rows = np.column_stack([track.times_s, track.positions])
    np.savetxt(tracks / "robot.csv", rows, delimiter=",", header="time,x,y", comments="")
    assert run(*quick(tmp_path, "--frame", "body")) == 0
    printed = capsys.readouterr().out
    assert "robot.csv has no heading, so it is left out in the body's frame" in printed
    assert "no recording to measure" in printed


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (("--band", "wide"), "the band 'wide' is not LOW:HIGH in Hz"),
        (("--window", "5"), "hold fewer than three windows"),
        (("--band", "0.5:40"), "band"),
    ],
)
def test_an_option_that_does_not_fit_gets_one_sentence(tmp_path, tracks, capfd, more, sentence):
    assert run(*quick(tmp_path, *more)) == (2 if "wide" in more else 1)
    error = capfd.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a.csv").exists()
