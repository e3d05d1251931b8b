import json
import subprocess
import sys

import pytest

from hil.cameras import CAMERAS
from hil.cli import CameraName, main
from mtm_audit.recordings.motion_capture import read_tum
from mtm_audit.recordings.video import read_frames
from mtm_onboard.protocol import load_key

QUICK = ["record", "--seconds", "2", "--wire", "direct"]


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


def test_a_recording_has_motion_capture_the_truth_and_the_key(tmp_path, capsys):
    assert run(*QUICK, "--message", 178, "--no-video", "--out", tmp_path / "a") == 0
    assert "keep it secret" in capsys.readouterr().out
    truth = json.loads((tmp_path / "a" / "truth.json").read_text())
    assert (truth["message"], truth["symbols"], truth["onset_s"]) == (178, [2, 3, 0, 2], 1.5)
    key = load_key(tmp_path / "a" / "robot.key")
    assert truth["scheme_fingerprint"] == key.scheme.fingerprint
    assert key.secret.hex() not in (tmp_path / "a" / "truth.json").read_text()
    assert len(read_tum(tmp_path / "a" / "mocap" / "robot3.tum").times_s) == 201
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["mocap", "robot.key", "truth.json"]


def test_a_recording_is_filmed_and_a_key_that_is_given_stays_where_it_is(tmp_path):
    run(*QUICK, "--message", 1, "--no-video", "--out", tmp_path / "a")
    key = tmp_path / "a" / "robot.key"
    assert run(*QUICK, "--no-message", "--key", key, "--out", tmp_path / "b") == 0
    assert sorted(path.name for path in (tmp_path / "b").iterdir()) == ["mocap", "truth.json", "video.mp4"]
    frames = list(read_frames(tmp_path / "b" / "video.mp4", "gray"))
    assert len(frames) == 61
    assert frames[0].size == (704, 704)
    truth = json.loads((tmp_path / "b" / "truth.json").read_text())
    assert (truth["message"], truth["onset_s"]) == (None, None)


def test_two_recordings_of_one_seed_and_key_are_equal(tmp_path):
    run(*QUICK, "--message", 1, "--no-video", "--out", tmp_path / "a")
    for name in ("b", "c"):
        run(*QUICK, "--message", 7, "--no-video", "--key", tmp_path / "a" / "robot.key", "--out", tmp_path / name)
    for path in ("truth.json", "mocap/robot1.tum"):
        assert (tmp_path / "b" / path).read_bytes() == (tmp_path / "c" / path).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--message", "256"], "does not fit"),
        (["--message", "1", "--key", "missing.key"], "missing.key"),
        (["--message", "1", "--seconds", "1"], "make it last longer"),
    ],
)
def test_what_cannot_be_recorded_gets_one_sentence_and_leaves_nothing(tmp_path, capfd, arguments, sentence):
    assert run(*QUICK, *arguments, "--no-video", "--out", tmp_path / "a") == 1
    error = capfd.readouterr().err
    assert error.startswith("mtm-hil: ")
    assert sentence in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_exists_is_not_overwritten(tmp_path, capfd):
    assert run(*QUICK, "--no-message", "--no-video", "--out", tmp_path) == 1
    assert "exists already" in capfd.readouterr().err


@pytest.mark.parametrize(
    "arguments", [[], ["--message", "1", "--no-message"], ["--no-message", "--wire", "smoke"], ["--message", "x"]]
)
def test_wrong_usage_ends_with_2(tmp_path, arguments):
    assert run("record", "--out", tmp_path / "a", *arguments) == 2


def test_an_interrupt_ends_with_130_and_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("hil.commands.record.run_lockstep", interrupted)
    assert run(*QUICK, "--no-message", "--out", tmp_path / "a") == 130
    assert list(tmp_path.iterdir()) == []


def test_every_camera_can_be_named():
    assert [name.value for name in CameraName] == list(CAMERAS)


def test_help_loads_neither_opencv_nor_scipy():
    code = "import sys; from hil.cli import main\ntry: main(['record', '--help'])\nfinally: print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "--no-video" in done.stdout
    assert not {"cv2", "scipy", "can", "numpy"} & set(done.stdout.split())
