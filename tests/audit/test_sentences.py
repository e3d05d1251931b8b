"""Sentences that sent people the wrong way, each with the one that sends them the right way."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from hil.sensors.video import write_video
from mtm_audit.cli import main
from mtm_audit.commands.unused import unused_options
from mtm_audit.model.picture import Frame
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import save_key
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1, 1), ticks=400))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two keys, motion capture of two robots, and a film of nothing."""
    path = tmp_path_factory.mktemp("sentences")
    save_key(KEY, path / "robot.key")
    rolling = key_of(replace(KEY.scheme, schedule="rolling"))
    save_key(rolling, path / "rolling.key")
    (path / "mocap").mkdir()
    for number, symbol in enumerate((3, 1)):
        track = robot_track(KEY, f"robot{number}", (symbol,), 10.0, onset_s=1.0, seed=number)
        write_tum(replace(track, headings_rad=np.zeros(len(track.times_s))), path / "mocap" / f"robot{number}.tum")
    blank = np.full((48, 64, 3), 90, np.uint8)
    write_video((Frame(0.1 * number, blank) for number in range(5)), path / "film.mp4")
    return path


@pytest.fixture
def decode(folder, capsys):
    def run(recording, *options, key="robot.key"):
        with pytest.raises(SystemExit) as left:
            main(["decode", str(folder / recording), "--key", str(folder / key), *options])
        out, err = capsys.readouterr()
        return left.value.code, out, err

    return run


def one_sentence(answer, words, code=1):
    assert answer[:2] == (code, "")
    assert answer[2].count("\n") == 1
    assert words in answer[2]
    return answer[2]


@pytest.mark.parametrize("what", ["film", "motion capture", "truth and motion capture"])
def test_a_folder_that_record_made_is_a_recording(decode, folder, tmp_path, what):
    made = tmp_path / "rec"
    shutil.copytree(folder / "mocap", made / "mocap")
    (made / "truth.json").write_text("{}")
    if what == "film":
        shutil.copy(folder / "film.mp4", made / "video.mp4")
        one_sentence(decode(made), "no marker found in 5 frames")
    else:
        code, out, _ = decode(made, "--onset", "1")
        assert code == 0
        assert "motion capture" in out


@pytest.mark.parametrize("mode", [0o600, 0o644])
@pytest.mark.parametrize("name", ["film.mp4", "mocap/robot0.tum"])
def test_what_is_no_key_is_not_to_be_kept_secret(decode, folder, name, mode):
    (folder / name).chmod(mode)
    error = one_sentence(
        decode("mocap", key=name), "is no key file; name the file that mtm-onboard keygen or issue wrote"
    )
    assert "chmod" not in error


def test_a_key_that_others_can_read_is_to_be_kept_secret(decode, folder, tmp_path):
    shutil.copy(folder / "robot.key", tmp_path / "open.key")
    (tmp_path / "open.key").chmod(0o644)
    one_sentence(decode("mocap", key=tmp_path / "open.key"), "can be read by others (mode 0644); run: chmod 600")


def test_a_key_in_the_place_of_a_recording_is_told(decode, folder, tmp_path, capsys):
    one_sentence(decode("robot.key"), "robot.key is a key file and no recording; name it with --key")
    made = tmp_path / "device.key"
    assert onboard(["device-key", "--out", str(made)]) == 0
    capsys.readouterr()
    one_sentence(decode(made), "is a key file and no recording")


@pytest.mark.parametrize("text", ["hello there\n", "[robot]\nname = 'r'\n", "a,b\nc,d\n"])
def test_text_that_is_no_log_is_not_to_be_mended(decode, tmp_path, text):
    (tmp_path / "notes.tum").write_text(text)
    error = one_sentence(decode(tmp_path / "notes.tum"), "")
    assert "remove the line" not in error


def test_a_log_with_one_bad_line_is_to_be_mended(decode, folder, tmp_path):
    lines = (folder / "mocap/robot0.tum").read_text().splitlines()
    (tmp_path / "bad.tum").write_text("\n".join([*lines[:20], "oops", *lines[20:]]))
    one_sentence(decode(tmp_path / "bad.tum"), "mend or remove the line")


@pytest.mark.parametrize("onset", ["99", "11.2"])
def test_an_onset_after_the_end_is_told(decode, onset):
    error = one_sentence(decode("mocap", "--onset", onset), f"before the onset of {onset} s; give --onset in that time")
    assert "record longer" not in error


def test_an_explanation_repeats_no_advice_of_another_fault(decode):
    code, _, err = decode("film.mp4", "--tracker", "colour:red", "--explain")
    assert code == 1
    assert "tracks     FAILED: none of red found" in err
    assert "name the colour that the robot has" in err
    assert "markers" not in err
    code, _, err = decode("mocap", "--explain", key="rolling.key")
    assert code == 1
    assert "timing     FAILED: this key's schedule is rolling" in err
    assert "say when the recording was made with --at" in err
    assert "whole message" not in err


def test_an_option_given_in_vain_is_told(decode):
    _, out, _ = decode(
        "mocap", "--onset", "1", "--tracker", "aruco", "--at", "2026-01-31T12:00:00Z", "--frame-rate", "30"
    )
    text = " ".join(out.split())
    assert "--frame-rate and --tracker were not used: the recording is motion capture" in text
    assert "--at was not used: the key's schedule is fixed" in text
    assert "not used" not in decode("mocap", "--onset", "1")[1]


@pytest.mark.parametrize(
    ("given", "kind", "schedule", "count"),
    [
        ({"--unit", "--up"}, "video", "rolling", 1), ({"--unit"}, "motion capture", "rolling", 0),
        ({"--tracker"}, "video", "fixed", 0), ({"--at"}, "video", "rolling", 0),
        ({"--at", "--body"}, "video", "fixed", 2),
    ],
)  # fmt: skip
def test_options_are_told_where_they_do_not_matter(given, kind, schedule, count):
    assert len(unused_options(frozenset(given), kind, schedule)) == count


def test_a_symbol_is_a_body_s_part_whether_it_sends_or_not(decode, folder):
    code, out, _ = decode("mocap/robot0.tum", "--onset", "1")
    assert code == 4
    assert "not seen: symbol 1, the part of robot1; record that robot too" in " ".join(out.split())


@pytest.mark.parametrize("name", ["body[left]", "[red]", "a[/b]", "[link=x]y"])
def test_names_that_look_like_markup_are_printed_whole(decode, folder, tmp_path, name):
    for number, own in ((0, name.replace("/", "")), (1, "robot1")):
        shutil.copy(folder / f"mocap/robot{number}.tum", tmp_path / f"{own}.tum")
    own = name.replace("/", "")
    code, out, _ = decode(tmp_path, "--onset", "1", "--assign", f"robot0={own}", "--explain")
    assert code == 0
    assert f"\nrobot0  {own}" in out
    assert f"tracks: {own}, robot1" in out or f"tracks: robot1, {own}" in out
