"""Markers: their corners at every angle, dictionaries, copies of a marker, and mirrors."""

import cv2
import numpy as np
import pytest

from hil.sensors.camera import top_pixels
from hil.sensors.optics import overhead
from hil.sensors.scene import Painter, Scene, Sighting
from mtm_audit.model.picture import Frame
from mtm_audit.tracking.corners import refined_corners
from mtm_audit.tracking.dictionaries import DICTIONARIES, cells_of, dictionary_of, reads_in_a_mirror, shown_instead
from mtm_audit.tracking.markers import MarkerFinder
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

SIZE = (240, 320)


def sheet(name, number, side_px):
    """The marker with a white margin of a cell."""
    marker = cv2.aruco.generateImageMarker(dictionary_of(name), number, side_px)
    return cv2.copyMakeBorder(marker, *(round(side_px / cells_of(name)),) * 4, cv2.BORDER_CONSTANT, value=255)


def put(image, picture, column, row):
    """Paint a picture with its middle at a whole pixel."""
    top, left = row - picture.shape[0] // 2, column - picture.shape[1] // 2
    image[top : top + picture.shape[0], left : left + picture.shape[1]] = picture


def film(*markers, frames=12, mirrored=False):
    """Frames of `markers`, each a picture, a column and a row of its middle as functions of the frame's number."""
    for number in range(frames):
        image = np.full(SIZE, 120, np.uint8)
        for picture, column, row in markers:
            put(image, picture, column(number), row(number))
        yield Frame(number / 30, np.ascontiguousarray(image[:, ::-1]) if mirrored else image)


def still(picture, column=100, row=100):
    return picture, lambda _: column, lambda _: row


def moving(picture, row=100):
    return picture, lambda number: 80 + 3 * number, lambda _: row


def scatter_px(angle_deg, count=25):
    """The worse axis' standard deviation of a marker's middle about the truth, over positions between pixels."""
    optics, rng = overhead(width_px=352, height_px=352, span_m=2.3), np.random.default_rng(1)
    painter, top = Painter(Scene(), optics, 0.6), Scene().top(3)
    finder = MarkerFinder("4x4_50")
    errors = []
    for _ in range(count):
        x_m, y_m = rng.uniform(-0.02, 0.02, 2)
        picture = painter.paint([Sighting(top, np.array([[x_m, y_m, np.deg2rad(angle_deg)]]))])
        noisy = np.clip(picture + rng.normal(size=picture.shape), 0, 255).astype(np.uint8)
        gray = cv2.cvtColor(noisy, cv2.COLOR_BGR2GRAY)
        (sighting,) = finder.refined(gray, finder.everywhere(gray))
        errors.append(sighting.centre - top_pixels(optics, np.array([[x_m, y_m]]))[0])
    return float(np.std(errors, axis=0).max())


@pytest.mark.parametrize("angle_deg", range(0, 50, 5))
def test_a_middle_is_as_sharp_at_every_angle(angle_deg):
    assert scatter_px(angle_deg) < 0.01


def test_corners_without_edges_are_refined_to_nothing():
    square = np.array([[[50.0, 50.0], [90.0, 50.0], [90.0, 90.0], [50.0, 90.0]]])
    assert np.isnan(refined_corners(np.full(SIZE, 90, np.uint8), square, 6)).all()
    assert np.isnan(refined_corners(np.full(SIZE, 90, np.uint8), square - 49.5, 6)).all()


@pytest.mark.parametrize("name", DICTIONARIES)
def test_every_dictionary_of_opencv_is_read(name):
    tracks = tracker(f"aruco:{name}").track(film(moving(sheet(name, 5, 60))))
    assert [track.name for track in tracks] == ["marker5"]
    assert tracks[0].valid.all()


def test_a_dictionary_is_named_as_opencv_does_too():
    picture = sheet("apriltag_36h11", 7, 64)
    (track,) = tracker("aruco:DICT_APRILTAG_36h11").track(film(moving(picture)))
    assert track.name == "marker7"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("6x6_250", "6x6_250 markers 3 and 7 are there; decode with --tracker aruco:6x6_250"),
        ("apriltag_36h11", "apriltag_36h11 markers 3 and 7 are there"),
        ("5x5_100", "5x5_250 markers 3 and 7 are there"),
    ],
)
@pytest.mark.parametrize("mirrored", [False, True])
def test_markers_of_another_dictionary_are_named(name, says, mirrored):
    frames = film(still(sheet(name, 3, 64), 80), moving(sheet(name, 7, 64), 180), mirrored=mirrored)
    with pytest.raises(MtmError, match=f"no marker of 4x4_50 found in 12 frames, but {says}"):
        tracker("aruco").track(frames)


def test_a_number_beyond_the_dictionary_is_named():
    with pytest.raises(MtmError, match="4x4_250 marker 77 is there"):
        tracker("aruco").track(film(moving(sheet("4x4_250", 77, 60))))


def test_a_larger_copy_does_not_silence_the_robots_marker():
    warnings = []
    small, poster = sheet("4x4_50", 0, 36), sheet("4x4_50", 0, 90)
    frames = film(moving(small, 60), still(poster, 240, 170), frames=20)
    robot, hanging = tracker("aruco", warnings.append).track(frames)
    assert [robot.name, hanging.name] == ["marker0", "marker0b"]
    assert robot.valid.all()
    assert np.ptp(robot.positions[:, 0]) == pytest.approx(57, abs=1)
    assert np.ptp(hanging.positions[:, 0]) < 0.1
    assert warnings == [
        "the marker 0 is in sight 2 times: marker0 is the one that moves most, marker0b what hangs elsewhere; cover "
        "that, or use --assign"
    ]


def test_a_copy_keeps_its_place_while_the_robot_is_hidden():
    small, poster = sheet("4x4_50", 0, 36), sheet("4x4_50", 0, 60)
    frames = []
    for number in range(30):
        image = np.full(SIZE, 120, np.uint8)
        put(image, poster, 240, 170)
        if not 10 <= number < 16:
            put(image, small, 60 + 3 * number, 60)
        frames.append(Frame(number / 30, image))
    robot, hanging = tracker("aruco").track(frames)
    assert np.array_equal(robot.valid, [not 10 <= number < 16 for number in range(30)])
    assert hanging.valid.all()


def test_a_marker_that_leaps_stays_one_track():
    picture = sheet("4x4_50", 4, 36)
    (track,) = tracker("aruco").track(film((picture, lambda number: 60 if number < 6 else 250, lambda _: 100)))
    assert track.name == "marker4"
    assert track.valid.all()


def test_markers_that_look_alike_in_a_mirror_are_known():
    assert [number for number in range(50) if reads_in_a_mirror("4x4_50", number)] == [8, 9, 17, 47]


@pytest.mark.parametrize("mirrored", [False, True])
def test_one_marker_that_tells_decides_for_all(mirrored):
    """It comes into sight when the symmetric ones have been seen for long."""
    warnings = []
    frames = []
    for number in range(60):
        image = np.full(SIZE, 120, np.uint8)
        put(image, sheet("4x4_50", 8, 42), 60 + number, 60)
        put(image, sheet("4x4_50", 17, 42), 100, 180)
        if number >= 40:
            put(image, sheet("4x4_50", 3, 42), 250, 180)
        frames.append(Frame(number / 30, np.ascontiguousarray(image[:, ::-1]) if mirrored else image))
    tracks = {track.name: track for track in tracker("aruco", warnings.append).track(frames)}
    assert list(tracks) == ["marker17", "marker3", "marker8"]
    eight = tracks["marker8"]
    assert np.diff(eight.positions[:, 0]) == pytest.approx(np.ones(59), abs=0.2)
    assert warnings == []


def test_a_film_that_cannot_tell_its_mirror_says_so():
    warnings = []
    tracker("aruco", warnings.append).track(film(moving(sheet("4x4_50", 8, 42)), frames=40))
    assert len(warnings) == 1
    assert "only markers that look the same in a mirror are seen (8)" in warnings[0]
    assert "aruco:4x4_50,mirrored" in warnings[0]
    (track,) = tracker("aruco:4x4_50,mirrored").track(film(moving(sheet("4x4_50", 8, 42)), frames=40))
    assert np.diff(track.positions[:, 0]) == pytest.approx(np.full(39, -3), abs=0.2)


def test_a_marker_that_is_fast_from_its_first_frame_on_is_kept():
    """By more than half its width a frame, so that it is not near where it was when it had been seen once."""
    picture = sheet("4x4_50", 4, 36)
    for first in (0, 3):
        blank = [Frame(number / 30, np.full(SIZE, 120, np.uint8)) for number in range(first)]
        quick = film((picture, lambda number: 60 + 45 * (number % 5), lambda _: 100), frames=15)
        shown = [Frame((first + number) / 30, one.image) for number, one in enumerate(quick)]
        (track,) = tracker("aruco").track([*blank, *shown])
        assert track.valid[first:].all()


class Refusing:
    """A detector that cannot refine a corner by its contour."""

    def detectMarkers(self, image):  # noqa: N802, named by OpenCV
        raise cv2.error("nContours.size() >= 2")


def test_a_contour_that_refines_no_corner_hides_no_marker():
    image = next(film(still(sheet("4x4_50", 3, 60)))).image
    finder = MarkerFinder("4x4_50")
    finder._everywhere = Refusing()
    assert [one.number for one in finder.everywhere(image)] == [3]


@pytest.mark.parametrize(("side_px", "count"), [(4, 0), (60, 1)])
def test_what_has_less_than_a_pixel_a_cell_is_no_marker(side_px, count):
    class Reading:
        def detectMarkers(self, image):  # noqa: N802, named by OpenCV
            quad = np.float32([[[20, 20], [20 + side_px, 20], [20 + side_px, 20 + side_px], [20, 20 + side_px]]])
            return (quad,), np.array([[3]]), ()

    finder = MarkerFinder("4x4_50")
    finder._everywhere = Reading()
    assert len(finder.everywhere(np.zeros(SIZE, np.uint8))) == count


def test_writing_is_not_named_as_a_marker(monkeypatch):
    def read(side_px):
        class Reading:
            def __init__(self, *_):
                pass

            def detectMarkers(self, image):  # noqa: N802, named by OpenCV
                quad = np.float32([[[9, 9], [9 + side_px, 9], [9 + side_px, 9 + side_px], [9, 9 + side_px]]])
                return (quad,), np.array([[1023]]), ()

        monkeypatch.setattr("cv2.aruco.ArucoDetector", Reading)
        return shown_instead([np.zeros(SIZE, np.uint8)] * 3, "4x4_50")

    assert read(3) is None
    assert "marker 1023 is" in read(40)
