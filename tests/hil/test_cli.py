import errno
import json
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime

import numpy as np
import pytest

from hil.cli import CameraName, main
from hil.experiments.detectors.calibrate import SLIPS_MPS
from hil.experiments.detectors.paper_figures import MARGINS
from hil.fleet.lockstep import run_lockstep
from hil.fleet.programs import program
from hil.sensors.cameras import CAMERAS
from hil.worlds.robomaster import tagged_scheme
from hil.worlds.vehicles import VEHICLES
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.readers.video import read_frames
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import load_key
from tests.patience import PATIENCE_S, until

QUICK = ["record", "--seconds", "2", "--wire", "direct"]


@pytest.fixture(scope="module")
def paper_key(tmp_path_factory):
    """Of the fixed schedule, so that two recordings with one seed are equal, whenever they are made."""
    path = tmp_path_factory.mktemp("key") / "paper.key"
    assert onboard(["keygen", "--preset", "paper-robomaster-fleet", "--id", "fake", "--out", str(path)]) == 0
    return path


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


def test_a_recording_has_motion_capture_the_truth_and_the_key(tmp_path, capsys):
    assert run(*QUICK, "--message", 178, "--no-video", "--out", tmp_path / "a") == 0
    output = capsys.readouterr().out
    assert "keep it secret" in output
    assert "it takes --seconds 13.5 to record it once" in output
    truth = json.loads((tmp_path / "a" / "truth.json").read_text())
    assert (truth["message"], len(truth["symbols"]), truth["onset_s"]) == (178, 12, 1.5)
    key = load_key(tmp_path / "a" / "robot.key")
    assert truth["scheme_fingerprint"] == key.scheme.fingerprint
    assert key.holding.grant.kind == "master"
    assert key.scheme == tagged_scheme() == load_key(preset_key(tmp_path)).scheme
    assert key.secret.master.hex() not in (tmp_path / "a" / "truth.json").read_text()
    assert len(read_log(tmp_path / "a" / "mocap" / "robot3.tum").tracks[0].times_s) == 201
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["mocap", "robot.key", "truth.json"]


def preset_key(folder):
    """What the key generator makes by default."""
    path = folder / "preset.key"
    assert onboard(["keygen", "--preset", "robomaster-fleet", "--id", "fake", "--out", str(path)]) == 0
    return path


@pytest.mark.parametrize("plant", [name for name in VEHICLES if name != "arm"])
def test_any_kind_of_robot_that_drives_can_be_recorded(plant, tmp_path, capsys):
    seconds = ["record", "--seconds", "4", "--wire", "direct", "--plant", plant, "--no-video"]
    assert run(*seconds, "--message", 178, "--out", tmp_path / "a") == 0
    key = load_key(tmp_path / "a" / "robot.key")
    assert key.scheme.channels[0].axes == VEHICLES[plant].kind.axes
    track = read_log(tmp_path / "a" / "mocap" / "robot0.tum").tracks[0]
    assert np.ptp(track.positions, axis=0).max() > 0.3
    assert (np.ptp(np.unwrap(track.headings_rad)) > 1.0) == (plant in {"spinning", "diff-drive", "create"})


def test_an_arm_does_not_drive_through_the_arena(tmp_path, capfd):
    assert run(*QUICK, "--no-message", "--plant", "arm", "--no-video", "--out", tmp_path / "a") == 2
    assert "the plant 'arm' does not drive through the fleet's arena; choose from: robomaster" in capfd.readouterr().err
    assert not (tmp_path / "a").exists()


def test_a_key_on_other_axes_than_the_robots_is_mentioned(tmp_path, capsys):
    run(*QUICK, "--message", 1, "--no-video", "--out", tmp_path / "a")
    given = ["--message", 1, "--no-video", "--key", tmp_path / "a" / "robot.key", "--plant", "diff-drive"]
    assert run(*QUICK, *given, "--out", tmp_path / "b") == 0
    assert "the key's noise is on vx, vy; diff-drive carries it on vx, wz" in capsys.readouterr().out


def test_a_rolling_recording_says_when_it_was_made(tmp_path, capsys):
    key = tmp_path / "rolling.key"
    channels = [f"--channel=robot{number}:vx,vy:1:0.1" for number in range(4)]
    keygen = ["--rate=50", "--band=0.5:5", "--alphabet=4", "--message-ticks=50", "--check=none", *channels]
    assert onboard(["keygen", "--id", "fake", "--name", "rolling", "--out", str(key), *keygen]) == 0
    assert run("record", "--seconds", "6", "--wire", "direct", "--message", 5, "--no-video", "--key", key,
               "--out", tmp_path / "a") == 0  # fmt: skip
    truth = json.loads((tmp_path / "a" / "truth.json").read_text())
    assert abs(truth["unix_s"] - time.time()) < 600.0
    began = datetime.fromtimestamp(truth["unix_s"], UTC).isoformat(timespec="milliseconds")
    assert f"decode it with --at {began.replace('+00:00', 'Z')}" in capsys.readouterr().out


def test_a_recording_is_filmed_and_a_given_key_stays(tmp_path):
    run(*QUICK, "--message", 1, "--no-video", "--out", tmp_path / "a")
    key = tmp_path / "a" / "robot.key"
    assert run(*QUICK, "--no-message", "--key", key, "--out", tmp_path / "b") == 0
    assert sorted(path.name for path in (tmp_path / "b").iterdir()) == ["mocap", "truth.json", "video.mp4"]
    frames = list(read_frames(tmp_path / "b" / "video.mp4", "gray"))
    assert len(frames) == 61
    assert frames[0].size == (704, 704)
    truth = json.loads((tmp_path / "b" / "truth.json").read_text())
    assert (truth["message"], truth["onset_s"]) == (None, None)


def test_a_film_can_be_that_of_a_surveillance_camera(tmp_path):
    assert run(*QUICK, "--no-message", "--quality", "surveillance", "--out", tmp_path / "a") == 0
    frames = list(read_frames(tmp_path / "a/video.mp4"))
    assert len(frames) == 31
    assert frames[-1].time_s == pytest.approx(2.0, abs=0.01)


def test_two_recordings_of_one_seed_and_key_are_equal(tmp_path, paper_key):
    for name in ("b", "c"):
        run(*QUICK, "--message", 7, "--no-video", "--key", paper_key, "--out", tmp_path / name)
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
def test_what_cannot_be_recorded_gets_one_sentence(tmp_path, capfd, arguments, sentence):
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


def test_in_real_time_programs_get_key_file_and_folder(tmp_path, monkeypatch, capsys, paper_key):
    def as_if_in_real_time(settings, key_file, folder):
        assert load_key(key_file) == settings.key
        assert folder.is_dir()
        assert settings.start_s == 4.0
        return run_lockstep(settings)

    monkeypatch.setattr("hil.commands.record.run_realtime", as_if_in_real_time)
    wanted = [
        "--seconds",
        "5",
        "--realtime",
        "--message",
        "1",
        "--no-video",
        "--out",
        tmp_path / "a",
        "--key",
        paper_key,
    ]
    assert run("record", *wanted) == 0
    assert (tmp_path / "a" / "onboard").is_dir()
    assert json.loads((tmp_path / "a" / "truth.json").read_text())["onset_s"] == 4.0
    table = capsys.readouterr().out
    assert table.count("250       0") == 4


def test_an_interrupt_ends_with_130_and_leaves_nothing(tmp_path, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("hil.commands.record.run_lockstep", interrupted)
    assert run(*QUICK, "--no-message", "--out", tmp_path / "a") == 130
    assert capsys.readouterr().err == "mtm-hil: interrupted; no half-written result is left\n"
    assert list(tmp_path.iterdir()) == []


def test_every_camera_can_be_named():
    assert [name.value for name in CameraName] == list(CAMERAS)


def test_help_loads_neither_opencv_nor_scipy():
    code = "import sys; from hil.cli import main\ntry: main(['record', '--help'])\nfinally: print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "--no-video" in done.stdout
    assert not {"cv2", "scipy", "can", "numpy"} & set(done.stdout.split())


@pytest.mark.parametrize(("request_to_end", "code", "says"), [(signal.SIGINT, 130, 1), (signal.SIGTERM, 143, 0)])
def test_a_program_that_is_asked_to_end_leaves_nothing(tmp_path, request_to_end, code, says):
    wanted = ["record", "--no-message", "--seconds", "5000", "--out", str(tmp_path / "a")]
    # Programs in the background inherit that interrupts are ignored, and this one is to be interrupted.
    heed = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    started = subprocess.Popen([program("mtm-hil"), *wanted], stderr=subprocess.PIPE, preexec_fn=heed)
    until(lambda: list(tmp_path.iterdir()))
    started.send_signal(request_to_end)
    _, error = started.communicate(timeout=PATIENCE_S)
    assert (started.returncode, error.count(b"\n")) == (code, says)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_gets_one_sentence(tmp_path, monkeypatch, capfd):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("hil.commands.record.write_recording", full)
    assert run(*QUICK, "--no-message", "--out", tmp_path / "a") == 1
    assert capfd.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def quick_rollouts(monkeypatch):
    """Rollouts with the paper's own margins at a slip of 0.0425 m/s and smaller ones at any other, in this process."""

    def as_in_the_paper(parameters, seed):
        far = 1.0 + 10.0 * abs(parameters["slip_mps"] - 0.0425)
        return {"decodes": 4, "correct": 3, "margin": MARGINS[parameters["message_ticks"]] / far}

    monkeypatch.setattr("hil.experiments.detectors.calibrate.decode_rollout", as_in_the_paper)
    monkeypatch.setattr("hil.experiments.detectors.paper_robomaster.decode_rollout", as_in_the_paper)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0})


def test_calibrating_writes_the_plant_and_prints_candidates(quick_rollouts, tmp_path, capsys):
    cells, plant = tmp_path / "cells.jsonl", tmp_path / "plant.toml"
    assert run("calibrate", "-n", 2, "--out", plant, "--cells", cells) == 0
    assert "slip_mps = 0.0425\n" in plant.read_text()
    assert plant.read_text().startswith("# mtm-hil calibrate -n 2\n")
    output = capsys.readouterr().out
    assert output.count("(75)") == 6 * len(SLIPS_MPS)
    assert len(cells.read_text().splitlines()) == 2 * 6 * len(SLIPS_MPS)


def test_the_paper_s_table_is_printed_and_written(quick_rollouts, tmp_path, capsys):
    wanted = ["-n", 2, "--out", tmp_path / "a.csv", "--cells", tmp_path / "cells.jsonl"]
    assert run("paper", "robomaster", *wanted) == 0
    assert capsys.readouterr().out.count("75.0 [") == 8
    assert (tmp_path / "a.csv").read_text().startswith(f"# mtm-hil paper robomaster -n 2 --out {tmp_path}/a.csv\n")
