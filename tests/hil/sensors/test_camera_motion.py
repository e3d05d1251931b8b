import numpy as np
import pytest

from hil.sensors.camera import Camera, film
from hil.sensors.camera_motion import CameraMotion
from hil.sensors.cameras import FLOORS
from hil.sensors.optics import Optics, overhead
from hil.sensors.poses import Trajectory
from hil.sensors.scene import Scene
from mtm_audit.tracking.aruco import ArucoTracker
from mtm_onboard.protocol import MtmError

FLOOR_POINT = np.array([[0.0, 0.0, 0.0]])


def still(x=0.4, y=0.2):
    return Trajectory("robot0", np.array([0.0, 60.0]), np.array([[x, y], [x, y]]), np.zeros(2))


def places(motion, seconds=60.0, optics=None):
    """Where the middle of the floor appears in each frame, (n, 2)."""
    optics = optics or overhead()
    instants_s = np.arange(0, seconds, 1 / 30)
    turned = motion.turned(optics, instants_s, seconds, np.random.default_rng(1))
    return np.array([one.project(FLOOR_POINT)[0] for one in turned])


@pytest.mark.parametrize("shake_px", [3.0, 30.0])
def test_a_shake_has_its_size_and_ends_at_its_frequency(shake_px):
    seen = places(CameraMotion(shake_px=shake_px))
    # The lever behind the camera adds a little to what the turn alone does.
    assert np.std(seen, axis=0) == pytest.approx([shake_px, shake_px], rel=0.15)
    power = np.abs(np.fft.rfft((seen - seen.mean(axis=0)) * np.hanning(len(seen))[:, None], axis=0)) ** 2
    above = np.fft.rfftfreq(len(seen), 1 / 30) > 3.2
    assert power[above].sum() < 0.01 * power.sum()


def test_a_pan_turns_the_picture_by_its_angle():
    seen = places(CameraMotion(pan_rad=0.2))
    focal_px = overhead().focal_px
    middle = (704 - 1) / 2
    assert seen[0] == pytest.approx([middle + focal_px * np.tan(0.1), middle], abs=0.1)
    assert seen[-1] == pytest.approx([middle - focal_px * np.tan(0.1), middle], abs=0.3)


def test_a_roll_turns_everything_about_the_middle():
    optics = overhead()
    turned = CameraMotion(roll_rad=0.17).turned(optics, np.arange(0, 9, 0.1), 9.0, np.random.default_rng(1))
    edge = np.array([one.project(np.array([[1.0, 0.0, 0.0]]))[0] for one in turned]) - 703 / 2
    angles = np.arctan2(edge[:, 1], edge[:, 0])
    assert angles.max() == pytest.approx(0.17, abs=0.002)
    assert angles.min() == pytest.approx(-0.17, abs=0.002)


def test_a_still_hand_moves_nothing():
    assert np.ptp(places(CameraMotion(), 1.0), axis=0) == pytest.approx([0, 0], abs=1e-9)


def test_a_shake_needs_a_size_and_a_band():
    with pytest.raises(MtmError, match="a shake has a size"):
        CameraMotion(shake_px=-1.0)
    with pytest.raises(MtmError, match="a shake has a size"):
        CameraMotion(shake_hz=0.05)


def test_a_turned_camera_sees_what_its_geometry_says():
    tilted = Optics(position_m=(0.3, -4.4, 4.6), target_m=(0.0, 0.0, 0.0), focal_px=1100, width_px=704, height_px=480)
    for motion, optics in ((CameraMotion(shake_px=8.0, roll_rad=0.1), overhead()),
                           (CameraMotion(shake_px=8.0, roll_rad=0.1), tilted)):  # fmt: skip
        camera = Camera(optics=optics, motion=motion)
        frames = list(film(camera, Scene(), [still()], np.random.default_rng(2), 0.0, 0.5))
        (track,) = ArucoTracker().track([type(one)(one.time_s, one.image[..., 1].copy()) for one in frames])
        rng = np.random.default_rng(2)
        rng.standard_normal(len(frames)), rng.random(len(frames))
        turned = motion.turned(optics, track.times_s, 0.5, rng)
        truth = np.array([one.project(np.array([[0.4, 0.2, 0.2]]))[0] for one in turned])
        truth[:, 1] = optics.height_px - 1 - truth[:, 1]
        assert np.abs(track.positions - truth).max() < 0.15


def test_floor_markers_lie_where_they_should():
    camera = Camera(optics=overhead())
    frames = list(film(camera, FLOORS["markers"], [still()], np.random.default_rng(2), 0.0, 0.1))
    tracks = ArucoTracker().track([type(one)(one.time_s, one.image[..., 1].copy()) for one in frames])
    assert [track.name for track in tracks] == ["marker0", "marker40", "marker41", "marker42", "marker43"]
    expected = camera.optics.project(np.array([[-1.6, -1.6, 0.0]]))[0]
    assert tracks[1].positions[0] == pytest.approx([expected[0], 703 - expected[1]], abs=0.5)
