import cv2
import numpy as np
import pytest

from hil.sensors.video import write_video
from mtm_audit.ingest.recording import read_recording
from mtm_audit.model.picture import Frame
from mtm_audit.reporting.still import region_of, still_of
from tests.audit.filmed_robots import Copy, transcode
from tests.audit.reporting.pictured import both_sent

HEIGHT, WIDTH, BESIDE = 120, 400, 60


def picture(column, *, mirrored=False):
    """A white picture with the marker 3 around a column, or its mirror."""
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 3, 48)
    image = np.full((HEIGHT, WIDTH), 255, dtype=np.uint8)
    image[30:78, column - 24 : column + 24] = marker
    return image[:, ::-1] if mirrored else image


def filmed(path, columns, *, mirrored=False):
    """A film in which the marker is at these columns, None where it is away; and the recording of it."""
    blank = np.full((HEIGHT, WIDTH), 255, dtype=np.uint8)
    images = [blank if column is None else picture(column, mirrored=mirrored) for column in columns]
    frames = [
        Frame(number / 30, np.ascontiguousarray(np.repeat(image[:, :, None], 3, axis=2)))
        for number, image in enumerate(images)
    ]
    write_video(iter(frames), path, 30.0, 12)
    return read_recording([path], "video")


def test_a_still_is_the_first_picture_that_shows_the_tracks(tmp_path):
    recording = filmed(tmp_path / "film.mp4", [None] * 6 + [100 + step for step in range(30)])
    still = still_of(recording, "aruco")
    assert still.time_s == pytest.approx(6 / 30, abs=1e-3)
    assert (still.size_px, still.mirrored) == ((WIDTH, HEIGHT), False)
    row = HEIGHT - 1 - recording.tracks[0].positions[6, 1]
    column = recording.tracks[0].positions[6, 0]
    assert still.image[round(row) - 24 : round(row) + 24, round(column) - 24 : round(column) + 24].min() < 64


def test_a_mirrored_film_is_shown_as_its_markers_are_read(tmp_path):
    recording = filmed(tmp_path / "film.mp4", [BESIDE + step for step in range(40)], mirrored=True)
    still = still_of(recording, "aruco:4x4_50,mirrored")
    assert still.mirrored
    shown = cv2.imdecode(np.frombuffer(still.jpeg(), dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    assert shown[30:78, BESIDE - 24 : BESIDE + 24].mean() < 160
    assert shown[30:78, WIDTH - BESIDE - 24 : WIDTH - BESIDE + 24].mean() > 240


def test_a_film_without_times_has_a_still(tmp_path):
    filmed(tmp_path / "film.mp4", [None] * 3 + [100 + step for step in range(30)])
    bare = Copy(suffix=".h264", codec="libx264", format="h264")
    transcode(tmp_path / "film.mp4", tmp_path / "film.h264", bare)
    recording = read_recording([tmp_path / "film.h264"], "video", frame_rate_hz=15.0)
    still = still_of(recording, "aruco")
    assert still.time_s == pytest.approx(3 / 15)
    assert still.size_px == (WIDTH, HEIGHT)


def test_motion_capture_and_lost_films_have_no_still(tmp_path):
    assert still_of(both_sent()[0]) is None
    recording = filmed(tmp_path / "film.mp4", [100 + step for step in range(10)])
    (tmp_path / "film.mp4").unlink()
    assert still_of(recording, "aruco") is None


@pytest.mark.parametrize(
    ("tracker", "region"),
    [
        ("flow:10,20,300,110", (10, 20, 300, 110)),
        ("brightness:10,20,300,110,60", (10, 20, 300, 110)),
        ("brightness:60", None),
        ("brightness", None),
        ("colour:red,green,blue,yellow", None),
        ("aruco:6x6_250,mirrored", None),
    ],
)
def test_the_region_of_a_tracker_is_that_of_its_name(tracker, region):
    assert region_of(tracker) == region
