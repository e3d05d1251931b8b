import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.arms import INNER_RGB, OUTER_RGB, ArmTracker
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

FRAMES = 80
TIMES_S = np.arange(FRAMES) / 50
BASE_PX = np.array([120.3, 119.6])
LENGTH_PX, RADIUS_PX = 50.0, 7.0
OPEN = np.stack([0.5 + 1.2 * np.sin(4 * TIMES_S), 1.0 + 0.8 * np.sin(5 * TIMES_S)], axis=1)


def along(angle_rad):
    return np.array([np.cos(angle_rad), -np.sin(angle_rad)])


def capsule(image, start, end, radius_px, rgb):
    across = radius_px * np.array([-(end - start)[1], (end - start)[0]]) / np.linalg.norm(end - start)
    corners = np.array([start + across, end + across, end - across, start - across])
    cv2.fillPoly(image, [np.round(corners * 16).astype(np.int32)], rgb[::-1], cv2.LINE_AA, 4)
    for point in (start, end):
        cv2.circle(image, np.round(point * 16).astype(int).tolist(), round(16 * radius_px) - 8, rgb[::-1], -1, 16, 4)


def arm(angles=OPEN, shift_px=(0.0, 0.0), hidden=(), target_px=(60, 60)):
    """An arm seen from above, between pink walls, with a red target and a teal fingertip; drawn at twice the size."""
    for number, (inner_rad, outer_rad) in enumerate(angles):
        image = np.full((480, 480, 3), 229, np.uint8)
        cv2.rectangle(image, (4, 4), (475, 475), (153, 102, 230), 12)
        base = 2 * (BASE_PX + shift_px) + 0.5
        elbow = base + 2 * LENGTH_PX * along(inner_rad)
        tip = elbow + 2 * LENGTH_PX * along(inner_rad + outer_rad)
        if number not in hidden:
            capsule(image, base, elbow, 2 * RADIUS_PX, INNER_RGB)
            capsule(image, elbow, tip, 2 * RADIUS_PX, OUTER_RGB)
            cv2.circle(image, np.round(tip * 16).astype(int).tolist(), 13 * 16, (153, 204, 0), -1, cv2.LINE_AA, 4)
        cv2.circle(image, (2 * target_px[0], 2 * target_px[1]), 12, (51, 51, 230), -1, cv2.LINE_AA)
        yield Frame(number / 50, cv2.resize(image, (240, 240), interpolation=cv2.INTER_AREA))


def rms_mrad(track, angles=OPEN):
    errors = (track.positions - angles)[track.valid]
    return 1e3 * np.sqrt(np.mean(errors**2, axis=0))


@pytest.mark.parametrize("smooth", [True, False])
def test_joint_angles_are_tracked_to_a_few_milliradians(smooth):
    (track,) = ArmTracker(smooth=smooth).track(arm())
    assert (track.name, track.axes, track.unit) == ("arm", ("inner", "outer"), "rad")
    assert track.valid.all()
    assert np.all(rms_mrad(track) < [3.0, 6.0])


def test_the_outer_link_s_direction_is_the_sum_of_both_angles():
    (track,) = ArmTracker(relative=False).track(arm())
    assert np.all(rms_mrad(track, np.cumsum(OPEN, axis=1)) < [3.0, 6.0])


def test_angles_run_on_beyond_a_turn():
    angles = np.stack([6 * TIMES_S, 0.8 * np.sin(5 * TIMES_S)], axis=1)
    (track,) = tracker("arms").track(arm(angles))
    assert track.positions[-1, 0] > 2 * np.pi
    assert np.all(rms_mrad(track, angles) < [3.0, 6.0])


def test_a_base_that_is_given_and_one_that_is_found_are_the_same():
    (found,) = ArmTracker().track(arm())
    (given,) = ArmTracker(base_px=tuple(BASE_PX)).track(arm())
    assert np.nanmax(np.abs(found.positions - given.positions)) < 0.006


def test_an_arm_that_hardly_moves_is_measured_too():
    angles = np.stack([0.5 + 0.03 * np.sin(9 * TIMES_S), 1.0 + 0.03 * np.sin(12 * TIMES_S)], axis=1)
    (track,) = tracker("arms").track(arm(angles))
    changes = np.diff(track.positions - angles, axis=0)
    assert track.valid.all()
    assert np.all(1e3 * np.std(changes, axis=0) < [3.0, 6.0])


def test_a_folded_link_is_measured_or_missing_and_never_wrong():
    angles = np.stack([0.5 + 0.6 * np.sin(4 * TIMES_S), 2.2 + 0.8 * np.sin(5 * TIMES_S)], axis=1)
    (track,) = tracker("arms").track(arm(angles))
    errors = np.abs(track.positions - angles)[track.valid]
    assert track.valid.mean() > 0.6
    assert errors.max() < 0.1


def test_an_arm_that_is_hidden_for_a_while_is_missing_meanwhile():
    (track,) = tracker("arms").track(arm(hidden=range(30, 45)))
    assert np.array_equal(np.flatnonzero(~track.valid), np.arange(30, 45))
    assert np.isnan(track.positions[30:45]).all()
    assert np.all(rms_mrad(track) < [3.0, 6.0])


def test_colours_may_be_named_or_ranges():
    for colours in ("#0066ff,#e6c800", "hsv(100-115,80-255,60-255),hsv(20-32,80-255,60-255)"):
        (track,) = tracker(f"arms:{colours}").track(arm())
        assert np.all(rms_mrad(track) < [8.0, 16.0])


@pytest.mark.parametrize("name", ["arms:red", "arms:red,blue,green", "arms:,"])
def test_links_that_are_not_two_colours_are_refused(name):
    with pytest.raises(MtmError, match="two links|is no colour"):
        tracker(name)


def test_an_arm_that_is_never_seen_is_refused():
    with pytest.raises(MtmError, match="#0066ff, the colour of the inner link, is not found in 80 frames"):
        tracker("arms").track(arm(hidden=range(FRAMES)))


def test_an_arm_with_one_link_out_of_view_is_refused():
    with pytest.raises(MtmError, match="green, the colour of the outer link, is not found"):
        tracker("arms:#0066ff,green").track(arm())


def test_a_picture_that_changes_its_size_is_refused():
    frames = [*arm(OPEN[:3]), *(Frame(1.0 + frame.time_s, frame.image[:100]) for frame in arm(OPEN[:3]))]
    with pytest.raises(MtmError, match=r"from 240 x 240 to 240 x 100 at 1\.000 s"):
        tracker("arms").track(frames)
