from dataclasses import replace

import cv2
import numpy as np
import pytest

from mtm_audit.model.pictured import Pictured
from mtm_audit.model.track import Track
from mtm_audit.reporting.overlay.marks import Marker
from mtm_audit.reporting.overlay.passing import Windows
from tests.audit.small_films import SIZE, frames, marker

TIMES_S = np.arange(3.0)
MIDDLE = (150.0, 100.0)
UP = np.array([MIDDLE[0], SIZE[1] - 1 - MIDDLE[1]])
TRACK = Track(
    "marker3", TIMES_S, np.stack([UP - [20, 0], UP - [10, 0], UP]), np.ones(3, bool), unit="px",
    headings_rad=np.zeros(3), extent_px=120.0,
)  # fmt: skip
WINDOWS = Windows("robot3", "marker3", "robot3", np.array([1.0]), 4.0, ("2",))
PICTURE = next(frames([(marker(number=3), MIDDLE, False)], seconds=1.0)).image
GRAY = np.asarray(cv2.cvtColor(PICTURE, cv2.COLOR_BGR2GRAY))


def marks_of(*tracks, flipped=False, dictionary="4x4_50", time_s=2.0, image=GRAY, windows=(WINDOWS,)):
    pictured = Pictured(tracks, SIZE, flipped)
    return Marker(pictured, windows, {"robot3": "marker3"}, dictionary).marks(image, time_s)


def test_a_marker_is_outlined_where_the_picture_shows_it():
    (mark,) = marks_of(TRACK)
    assert mark.place == pytest.approx(MIDDLE)
    assert mark.outline.mean(axis=0) == pytest.approx(MIDDLE, abs=0.6)
    assert np.ptp(mark.outline, axis=0) == pytest.approx([39, 39], abs=2)


def test_body_track_and_passing_symbol_are_named():
    (mark,) = marks_of(TRACK)
    assert (mark.name, mark.notes, mark.passed) == ("robot3 · marker3", ("symbol 2",), 0.25)
    (before,) = marks_of(TRACK, time_s=0.0)
    assert (before.notes, before.passed) == ((), None)


def test_the_trail_ends_where_the_thing_is():
    (mark,) = marks_of(TRACK)
    assert mark.trail[-1] == pytest.approx(MIDDLE)
    assert mark.trail[:, 0] == pytest.approx([140.0, 150.0])


def test_what_the_tracker_did_not_see_is_said():
    valid = np.array([True, True, False])
    unseen = replace(TRACK, valid=valid, positions=np.where(valid[:, None], TRACK.positions, np.nan))
    (mark,) = marks_of(unseen)
    assert (mark.place, mark.outline) == (None, None)
    assert mark.notes == ("symbol 2", "not seen")
    assert mark.last_place == pytest.approx((140.0, 100.0))


def test_a_mirrored_film_is_drawn_as_it_is():
    mirrored = np.ascontiguousarray(GRAY[:, ::-1])
    (mark,) = marks_of(TRACK, flipped=True, image=mirrored)
    assert mark.place == pytest.approx((SIZE[0] - 1 - MIDDLE[0], MIDDLE[1]))
    assert mark.outline.mean(axis=0) == pytest.approx(mark.place, abs=0.6)
    assert mark.heading_rad == pytest.approx(np.pi)


def test_a_coloured_patch_is_circled_as_large_as_it_is():
    (mark,) = marks_of(replace(TRACK, name="red", headings_rad=None, extent_px=75.0), dictionary=None, windows=())
    assert mark.outline.mean(axis=0) == pytest.approx(MIDDLE)
    assert np.ptp(mark.outline, axis=0) == pytest.approx([37.5, 37.5], abs=0.5)
    assert mark.name == "red"


def test_an_arm_s_angles_are_written_without_a_place():
    arm = Track("arm", TIMES_S, np.full((3, 2), np.pi / 2), np.ones(3, bool), axes=("inner", "outer"), unit="rad")
    (mark,) = marks_of(arm, dictionary=None, windows=())
    assert (mark.place, mark.notes) == (None, ("inner 90.0°", "outer 90.0°"))


def test_a_picture_that_the_tracker_never_saw_has_no_marks():
    assert marks_of(TRACK, time_s=1.5) == []
    assert marks_of(TRACK, time_s=9.0) == []


def test_channels_of_one_body_are_told_apart():
    other = replace(WINDOWS, channel="robot3.turn", symbols=("0",))
    (mark,) = marks_of(TRACK, windows=(WINDOWS, other))
    assert mark.notes == ("robot3 2", "robot3.turn 0")
