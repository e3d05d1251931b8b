import numpy as np
import pytest

from mtm_audit.survey.kept import MOST_KEPT, kept_frames
from mtm_audit.survey.motion import camera_motion, moving, tracked_motion
from mtm_audit.survey.regions import moving_regions
from mtm_onboard.protocol import MtmError
from tests.audit.small_films import frames, marker, patch, texture

FLOOR = texture()


def gray(*things, **how):
    for frame in frames(list(things), **how):
        yield type(frame)(frame.time_s, np.ascontiguousarray(frame.image[..., 1]))


def swung(seconds, reach_px=6.0, hz=1.0):
    times_s = np.arange(round(seconds * 30)) / 30
    return np.stack([reach_px * np.sin(2 * np.pi * hz * times_s), np.zeros(len(times_s))], axis=1)


def test_motion_is_told_in_pixels():
    shown = gray((marker(number=1), (80, 80), swung(4.0)), (marker(number=2), (200, 150), False), seconds=4.0)
    (swinging, resting), camera = tracked_motion(shown, "aruco", pytest.fail)
    assert swinging.name == "marker1"
    assert swinging.travel_px == pytest.approx(12.0, abs=0.3)
    assert swinging.fast_px == pytest.approx(6.0 / 2.0, rel=0.1)  # on one of two axes, 6 / sqrt(2) rms
    assert (swinging.seen, swinging.has_heading) == (1.0, True)
    assert resting.is_still
    assert moving((swinging, resting)) == (swinging,)
    assert not camera.moves


def test_a_steady_drive_is_slow_however_far_it_goes():
    drive = np.stack([np.linspace(-60, 60, 120), np.zeros(120)], axis=1)
    (found,), _ = tracked_motion(gray((marker(), (160, 120), drive), seconds=4.0), "aruco", pytest.fail)
    assert found.travel_px == pytest.approx(120.0, abs=1.0)
    assert found.fast_px < 0.2


def test_a_camera_that_shakes_is_told_from_a_robot_that_does():
    shift = swung(2.0, 4.0)
    shown = gray((marker(), (160, 120), False), seconds=2.0, floor=FLOOR, shift=shift)
    (found,), camera = tracked_motion(shown, "aruco", pytest.fail)
    assert camera.rms_px == pytest.approx(4.0 / 2.0, rel=0.15)
    assert "the camera moved by" in camera.sentence
    assert found.is_still


def test_the_background_alone_tells_whether_the_camera_moves():
    shaken = camera_motion(gray(seconds=2.0, floor=FLOOR, shift=swung(2.0, 4.0)))
    assert shaken.rms_px == pytest.approx(4.0 / 2.0, rel=0.15)
    assert camera_motion(gray(seconds=1.0, floor=FLOOR)).rms_px == 0.0
    assert camera_motion(gray(seconds=1.0)).rms_px is None


def test_some_pictures_are_kept_however_long_the_film():
    times_s, kept = kept_frames(frames([], seconds=7.0))
    assert len(times_s) == 210
    assert 4 <= len(kept) <= MOST_KEPT
    assert kept[0].time_s == 0.0
    assert np.ptp(np.diff([frame.time_s for frame in kept])) < 1e-9
    assert kept[-1].time_s > 0.5 * times_s[-1]


def test_a_film_without_pictures_is_refused():
    with pytest.raises(MtmError, match="no picture"):
        kept_frames(iter(()))


def test_a_region_is_where_the_first_picture_shows_what_moves():
    path = np.stack([np.linspace(0, 150, 60), np.linspace(0, 60, 60)], axis=1)
    shown = list(frames([(patch((60, 60, 60), 40), (70, 70), path)], seconds=2.0, floor=FLOOR))[::8]
    (region,) = moving_regions(shown)
    assert region == pytest.approx((50, 50, 90, 90), abs=6)
    assert moving_regions(shown[:2]) == ()
