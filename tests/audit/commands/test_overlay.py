"""`mtm-audit decode --overlay` and `--sheet`, as a person calls them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from mtm_audit.cli import main
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import save_key
from tests.audit.moving_robot import key_of, robot_track, scheme_of
from tests.audit.small_films import film, marker

SIZE, SECONDS = (480, 360), 4.0
KEY = key_of(scheme_of(symbols=(1, 1), ticks=100))
TRACKS = [
    robot_track(KEY, f"robot{number}", (symbol,), SECONDS, onset_s=0.5, seed=number, rate_hz=30.0)
    for number, symbol in enumerate((3, 1))
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A film of two robots that send, and the key."""
    path = tmp_path_factory.mktemp("overlay")
    save_key(KEY, path / "robot.key")
    write_tum(replace(TRACKS[0], headings_rad=np.zeros(len(TRACKS[0].times_s))), path / "robot0.tum")
    things = []
    for number, track in enumerate(TRACKS):
        path_px = 70.0 * track.positions * [1.0, -1.0]
        things.append((marker(number=number, side_px=30), (SIZE[0] / 2, SIZE[1] / 2), path_px))
    film(path / "film.mp4", things, seconds=SECONDS, size=SIZE)
    return path


@pytest.fixture
def audit(folder, capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main(["decode", *map(str, arguments), "--key", str(folder / "robot.key"), "--onset", "0.5"])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


def refused(answer, words, code=1):
    left, out, err = answer
    assert (left, out) == (code, "")
    assert (err.startswith("mtm-audit: "), err.count("\n")) == (True, 1)
    assert words in err


def changed(drawn, plain):
    """The share of pixels that were drawn on."""
    difference = np.abs(drawn[: plain.shape[0]].astype(int) - plain).max(axis=2)
    return float(np.mean(difference > 60))


def test_film_and_sheet_show_what_was_seen(audit, folder, tmp_path):
    code, out, _ = audit(folder / "film.mp4", "--overlay", tmp_path / "o.mp4", "--sheet", tmp_path / "s.png")
    assert (code, out.splitlines()[0]) == (0, "decoded: message 13 (0b1101)")
    drawn, plain = (list(read_frames(path, "bgr")) for path in (tmp_path / "o.mp4", folder / "film.mp4"))
    assert [frame.time_s for frame in drawn] == pytest.approx([frame.time_s for frame in plain], abs=2e-5)
    assert drawn[0].size[0] == plain[0].size[0]
    assert 0.0 < drawn[0].size[1] - plain[0].size[1] < 150
    assert all(0.005 < changed(one.image, other.image) < 0.2 for one, other in zip(drawn, plain, strict=True))
    sheet = cv2.imread(str(tmp_path / "s.png"))
    assert sheet.shape[1] > 3 * SIZE[0]
    assert sheet.shape[0] > 4 * SIZE[1]


def test_a_still_is_one_picture_of_the_film(audit, folder, tmp_path):
    code, _, _ = audit(folder / "film.mp4", "--overlay", tmp_path / "o.png")
    assert code == 0
    still = cv2.imread(str(tmp_path / "o.png"))
    assert still.shape[1] == SIZE[0]
    assert min(changed(still, frame.image) for frame in read_frames(folder / "film.mp4", "bgr")) < 0.1


@pytest.mark.parametrize(
    ("option", "name", "words", "code"),
    [
        ("--overlay", "o.avi", "is no film or picture format that can be drawn; end the name in .mp4, .png", 2),
        ("--sheet", "s.jpg", "is no picture format that can be drawn; end the name in .png", 2),
        ("--overlay", "nowhere/o.mp4", "choose a folder that exists and is writable", 1),
    ],
)
def test_what_cannot_be_written_is_refused_at_once(audit, folder, tmp_path, option, name, words, code):
    refused(audit(folder / "film.mp4", option, tmp_path / name), words, code)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_place_of_a_file_is_refused(audit, folder, tmp_path):
    (tmp_path / "o.mp4").mkdir()
    refused(audit(folder / "film.mp4", "--overlay", tmp_path / "o.mp4"), "is a folder; name a file")


def test_motion_capture_has_no_pictures_to_draw_on(audit, folder, tmp_path):
    answer = audit(folder / "robot0.tum", "--overlay", tmp_path / "o.mp4", "--sheet", tmp_path / "s.png")
    refused(answer, "has no pictures to draw on; leave --overlay and --sheet out")


def test_the_recording_itself_is_not_drawn_over(audit, folder):
    before = (folder / "film.mp4").read_bytes()
    answer = audit(folder / "film.mp4", "--overlay", folder / "film.mp4", "--force")
    refused(answer, "is the recording itself")
    assert (folder / "film.mp4").read_bytes() == before


def test_several_films_are_drawn_one_by_one(audit, folder, tmp_path):
    (tmp_path / "copy.mp4").write_bytes((folder / "film.mp4").read_bytes())
    answer = audit(folder / "film.mp4", tmp_path / "copy.mp4", "--sheet", tmp_path / "s.png")
    refused(answer, "--sheet draws one recording, and 2 are named; name one")


def test_a_film_without_the_tracker_s_things_leaves_no_overlay(audit, folder, tmp_path):
    refused(audit(folder / "film.mp4", "--tracker", "colour:red", "--overlay", tmp_path / "o.mp4"), "none of red found")
    assert list(tmp_path.iterdir()) == []


def test_chapters_of_one_film_are_drawn_as_one(audit, folder, tmp_path):
    for name in ("GX010001.MP4", "GX020001.MP4"):
        (tmp_path / name).write_bytes((folder / "film.mp4").read_bytes())
    code, _, _ = audit(tmp_path, "--overlay", tmp_path / "o.mp4")
    assert code in (0, 3, 4)
    times_s = [frame.time_s for frame in read_frames(tmp_path / "o.mp4")]
    assert len(times_s) == 2 * len(list(read_frames(folder / "film.mp4")))
    assert np.all(np.diff(times_s) > 0)
