"""`mtm-audit look`, as a person calls it."""

import io
import json
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import cv2
import jsonschema
import numpy as np
import pytest

from mtm_audit.cli import main
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import save_key
from tests.audit.logs_to_look_at import several_poses, table
from tests.audit.moving_robot import key_of, robot_track, scheme_of
from tests.audit.readers.video.films import Encoding, write_film
from tests.audit.small_films import CYAN, RED, film, frames, marker, patch, texture

ROOT = Path(__file__).parents[3]
SCHEMA = json.loads((ROOT / "mtm_audit/reporting/look/look.schema.json").read_text(encoding="utf-8"))
SIZE, SECONDS = (480, 360), 6.0
KEY = key_of(scheme_of(symbols=(1, 1), ticks=100))
MARKERS = [(marker(number=1), (80, 80), True), (marker(number=2), (220, 150), True)]


def robots(things):
    """The things where two robots that send 3 and 1 are."""
    tracks = [
        robot_track(KEY, f"robot{number}", (symbol,), SECONDS, onset_s=0.5, seed=number, rate_hz=30.0)
        for number, symbol in enumerate((3, 1))
    ]
    middle = SIZE[0] / 2, SIZE[1] / 2
    paths = [70.0 * track.positions * [1.0, -1.0] for track in tracks]
    return [(thing, middle, path) for thing, path in zip(things, paths, strict=True)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("look")
    film(path / "film.mp4", MARKERS, seconds=1.0)
    return path


@pytest.fixture
def look(capsys):
    """Run `mtm-audit look`; gives the exit code, standard output and standard error."""

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main(["look", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


@pytest.fixture(scope="module")
def looked(folder):
    """What it says of the film as JSON, with a picture beside."""
    out = io.StringIO()
    with pytest.raises(SystemExit) as left, redirect_stdout(out):
        main(["look", str(folder / "film.mp4"), "--json", "--picture", str(folder / "grid.png")])
    assert left.value.code in (None, 0)
    return json.loads(out.getvalue())["recordings"][0]


@pytest.fixture
def told(look):
    """What it says of one recording as JSON that fits the schema."""

    def run(*arguments):
        code, out, _ = look(*arguments, "--json")
        assert code == 0
        answer = json.loads(out)
        jsonschema.Draft202012Validator(SCHEMA).validate(answer)
        return answer["recordings"][0]

    return run


def line(out, head):
    return next(text for text in out.splitlines() if text.startswith(f"{head} "))


def refused(answer, words, code=1):
    assert answer[:2] == (code, "")
    assert (answer[2].startswith("mtm-audit: "), answer[2].count("\n")) == (True, 1)
    assert words in answer[2]


def test_a_film_is_told_in_lines(look, folder):
    code, out, err = look(folder / "film.mp4")
    assert (code, err) == (0, "")
    assert line(out, "film").endswith("film.mp4: H.264 in mp4, 320 x 240 pixels")
    assert line(out, "times").split(None, 1)[1].startswith("30 pictures, 1.0 s from 0.000 s on, 30 a second, constant;")
    assert line(out, "times").endswith("stated by the file")
    assert "stands still" in line(out, "camera")
    assert "4x4_50: 1, 2, 39 px wide" in line(out, "markers")
    assert "none that stand out" in line(out, "colours")
    assert "marker1: seen in 100 % of the pictures, goes 24 px" in line(out, "motion")
    assert "motion up to 15 Hz" in out
    assert "390 px a metre" in line(out, "carries")
    assert line(out, "try").endswith(f"mtm-audit decode {folder / 'film.mp4'} --key robot.key")


@pytest.mark.parametrize(
    ("things", "option"),
    [
        ([marker("6x6_250", 0, 32), marker("6x6_250", 1, 32)], "--tracker aruco:6x6_250"),
        ([patch(RED), patch(CYAN)], "--tracker 'colour:"),
    ],
    ids=["markers", "colours"],
)
def test_the_first_command_works_as_it_stands(look, capsys, tmp_path, monkeypatch, things, option):
    monkeypatch.chdir(tmp_path)
    save_key(KEY, Path("robot.key"))
    film(Path("my film.mp4"), robots(things), seconds=SECONDS, size=SIZE)
    _, out, _ = look("my film.mp4")
    command = line(out, "try").removeprefix("try").strip()
    assert option in command
    with pytest.raises(SystemExit) as left:
        main(shlex.split(command)[1:])
    assert left.value.code in (None, 0)
    assert capsys.readouterr().out.startswith("decoded: message 13")


def test_json_says_the_same_in_numbers(looked, folder):
    assert (looked["kind"], looked["size_px"], looked["times"]) == ("film", [320, 240], "stated")
    assert [(one["dictionary"], one["number"]) for one in looked["markers"]] == [("4x4_50", 1), ("4x4_50", 2)]
    assert np.mean(looked["markers"][0]["corners_px"], axis=0) == pytest.approx([92, 80], abs=1)
    assert looked["trackers"] == ["aruco:4x4_50"]
    assert looked["camera"]["motion_px"] == 0.0


def test_every_field_is_in_the_page(looked, told, tmp_path):
    page = (ROOT / "docs/look.md").read_text(encoding="utf-8")
    log = told(table(tmp_path / "left.csv", [(0.1 * number, 0.0, 0.0) for number in range(20)]))
    names = {*looked, *log, *log["bodies"][0], *log["bodies"][0]["timeline"]}
    assert [name for name in sorted(names) if f"`{name}`" not in page] == []


def test_the_picture_has_a_grid_and_what_was_found(looked, folder):
    drawn = cv2.imread(str(folder / "grid.png"))
    plain = next(read_frames(folder / "film.mp4", "bgr")).image
    assert drawn.shape[1] == plain.shape[1]
    changed = np.abs(drawn[: plain.shape[0]].astype(int) - plain).max(axis=2) > 40
    columns = [column for column in range(320) if changed[:, column].mean() > 0.7]
    rows = [row for row in range(240) if changed[row].mean() > 0.7]
    assert columns == list(range(20, 320, 20))
    assert rows == list(range(20, 240, 20))
    outline = changed[110:130, 92 - 25 : 92 + 25]
    assert outline.any()


def test_a_film_whose_things_have_no_marker_names_regions(told, tmp_path):
    path = np.stack([np.linspace(0, 150, 60), np.linspace(0, 60, 60)], axis=1)
    robot = cv2.cvtColor(texture((40, 40), 5), cv2.COLOR_GRAY2BGR)[:44, :44] // 3
    found = told(film(tmp_path / "film.mp4", [(robot, (70, 70), path)], seconds=2.0, floor=texture()))
    assert found["markers"] == found["colours"] == []
    region = found["regions_px"][0]
    assert region == pytest.approx([48, 48, 92, 92], abs=8)
    assert found["trackers"][0] == f"flow:{','.join(map(str, region))}"


def test_a_stream_without_a_rate_asks_for_one(look, tmp_path):
    plain = [np.full((96, 128, 3), 99, np.uint8)] * 10
    bare = write_film(
        tmp_path / "camera.mjpeg", plain, Encoding(codec="mjpeg", format="mjpeg", pixel_format="yuvj420p")
    )
    refused(look(bare), "--frame-rate")
    code, out, _ = look(bare, "--frame-rate", "15")
    assert code == 0
    assert "15 a second, constant; by --frame-rate 15" in line(out, "times")


def test_a_moving_camera_and_what_stands_still_are_told(told, tmp_path):
    times_s = np.arange(60) / 30
    shift = np.stack([5 * np.sin(2 * np.pi * times_s), 3 * np.cos(2 * np.pi * times_s)], axis=1)
    things = [(marker(number=1), (80, 80), True), (marker(number=40), (220, 150), False)]
    found = told(film(tmp_path / "film.mp4", things, seconds=2.0, shift=shift, floor=texture()))
    assert found["camera"]["motion_px"] == pytest.approx(2.9, rel=0.2)
    assert found["reference"] == ["marker40"]
    assert "--reference marker40" in found["commands"][0]


def test_single_pictures_are_a_film(look, told, tmp_path):
    for number, frame in enumerate(frames(MARKERS, seconds=0.3)):
        cv2.imwrite(str(tmp_path / f"{number:03d}.png"), frame.image)
    refused(look(tmp_path), "--frame-rate")
    found = told(tmp_path, "--frame-rate", "30")
    assert (found["times"], found["codec"], found["timeline"]["count"]) == ("single pictures", None, 9)
    assert "--frame-rate 30" in found["commands"][0]


def test_a_bag_lists_topics_and_how_to_name_one(look, told, tmp_path):
    bag = several_poses(tmp_path / "bag")
    _, out, _ = look(bag)
    assert line(out, "log").endswith("bag: ROS 2 bag")
    assert "/odom: bag: 301 samples, 3.0 s" in line(out, "topics")
    assert line(out, "try").endswith("--key robot.key --topic /odom")
    assert [topic["name"] for topic in told(bag)["topics"]] == ["/odom", "/pose", "/tf:odom.base"]
    assert told(bag, "--topic", "/pose")["bodies"][0]["headings"] == 1.0


def test_logs_of_several_bodies_are_told_one_by_one(look, tmp_path):
    rows = [(0.1 * number, 0.01 * number, 0.0) for number in range(50)]
    for name in ("left", "right"):
        table(tmp_path / f"{name}.csv", rows)
    code, out, _ = look(tmp_path)
    assert code == 0
    assert out.count("log        ") == 2
    assert "left: 50 samples, 4.9 s from 0.000 s on, 10 a second, constant, x,y in m, goes 0.49 m, no headings" in out
    assert out.count("\ntry ") == 1


def test_several_films_are_looked_at_one_after_the_other(look, tmp_path):
    (tmp_path / "torn.mp4").write_bytes(b"no film at all")
    film(tmp_path / "other.mp4", [], seconds=0.2)
    film(tmp_path / "one.mp4", [], seconds=0.2)
    code, out, err = look(tmp_path / "one.mp4", tmp_path / "torn.mp4", tmp_path / "other.mp4")
    assert code == 1
    assert [text for text in out.splitlines() if text.startswith("== ")] == [
        f"== {tmp_path / 'one.mp4'}", f"== {tmp_path / 'other.mp4'}"
    ]  # fmt: skip
    assert err.startswith(f"mtm-audit: {tmp_path / 'torn.mp4'}: ")
    code, out, _ = look(tmp_path / "one.mp4", tmp_path / "other.mp4", "--json")
    assert (code, len(json.loads(out)["recordings"])) == (0, 2)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: path.write_bytes(b""), "empty"),
        (lambda path: path.write_bytes(bytes(range(256)) * 40), "is not a video that can be read"),
        (lambda path: path.mkdir(), "holds no video, no pictures and no log"),
        (lambda path: None, "check the name"),
    ],
    ids=["empty", "noise", "empty folder", "missing"],
)
def test_what_is_no_recording_is_refused(look, tmp_path, make, words):
    make(tmp_path / "film.mp4")
    refused(look(tmp_path / "film.mp4"), words)


def test_a_picture_that_cannot_be_drawn_is_refused(look, folder, tmp_path):
    refused(look(folder / "film.mp4", "--picture", tmp_path / "grid.jpg"), "end the name in .png", code=2)
    refused(look(folder / "film.mp4", "--picture", tmp_path / "no" / "grid.png"), "choose a folder that exists")
    rows = table(tmp_path / "left.csv", [(0.1 * number, 0.0, 0.0) for number in range(20)])
    refused(look(rows, "--picture", tmp_path / "grid.png"), "has no pictures to draw on")
    two = folder / "film.mp4", film(tmp_path / "other.mp4", [], seconds=0.2)
    refused(look(*two, "--picture", tmp_path / "grid.png"), "draws one recording, and 2 are named")
    assert not (tmp_path / "grid.png").exists()


def test_a_picture_of_the_recording_is_not_drawn_over(look, tmp_path):
    for number, frame in enumerate(frames(MARKERS, seconds=0.2)):
        cv2.imwrite(str(tmp_path / f"{number:03d}.png"), frame.image)
    before = (tmp_path / "000.png").read_bytes()
    pictures = sorted(tmp_path.iterdir())
    answer = look(*pictures, "--frame-rate", "30", "--picture", tmp_path / "000.png", "--force")
    refused(answer, "is the recording itself")
    assert (tmp_path / "000.png").read_bytes() == before


def test_a_film_that_changes_its_size_is_refused(look, tmp_path):
    for number in range(4):
        size = (200 + 20 * (number > 1), 100, 3)
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full(size, 99, np.uint8))
    refused(look(tmp_path, "--frame-rate", "30"), "the picture changes from 100 x 200 to 100 x 220")


def test_a_rate_that_cannot_be_is_a_wrong_value(look, folder):
    refused(look(folder / "film.mp4", "--frame-rate", "0"), "above zero", code=2)


def test_a_wrong_option_is_a_usage_error(look, folder):
    code, out, _ = look(folder / "film.mp4", "--key", "robot.key")
    assert (code, out) == (2, "")
    code, out, _ = look()
    assert (code, out) == (2, "")
