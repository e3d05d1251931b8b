import numpy as np
import pytest

from hil.sensors.motion_capture import MotionCapture, capture, write_tum, write_tum_files
from hil.sensors.poses import Occlusion, Trajectory
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.registry import read_log
from mtm_onboard.protocol import MtmError


def circle(name="robot0", seconds=4.0, start_s=10.0):
    times_s = start_s + np.arange(round(seconds * 200) + 1) / 200
    angles = 2 * np.pi * 0.5 * times_s
    return Trajectory(name, times_s, np.stack([np.cos(angles), np.sin(angles)], axis=1), angles + np.pi / 2)


def wrapped(angles):
    return (angles + np.pi) % (2 * np.pi) - np.pi


def test_a_trajectory_is_interpolated_through_a_wrapped_heading():
    trajectory = Trajectory("robot0", np.array([0.0, 1.0]), np.array([[0.0, 2.0], [1.0, 4.0]]), np.array([3.1, -3.1]))
    position, heading = trajectory.at(np.array([0.5]))
    assert position == pytest.approx(np.array([[0.5, 3.0]]))
    assert heading == pytest.approx([np.pi])


def test_a_trajectory_whose_arrays_disagree_is_refused():
    with pytest.raises(MtmError, match="one length"):
        Trajectory("robot0", np.arange(3.0), np.zeros((2, 2)), np.zeros(3))


def test_samples_come_at_the_rate_and_carry_the_stated_noise():
    (track,) = capture(MotionCapture(), [circle(seconds=20.0)], np.random.default_rng(1))
    truth, headings = circle(seconds=20.0).at(10.0 + track.times_s)
    assert len(track.times_s) == 2001
    assert np.diff(track.times_s) == pytest.approx(0.01)
    assert (track.positions - truth).std() == pytest.approx(0.0005, rel=0.1)
    assert (track.headings_rad - headings).std() == pytest.approx(0.002, rel=0.1)


def test_the_same_seed_gives_the_same_recording():
    one, same, other = (
        capture(MotionCapture(), [circle()], np.random.default_rng(seed))[0].positions for seed in (1, 1, 2)
    )
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_lost_samples_are_not_valid_and_hold_no_numbers():
    system = MotionCapture(dropout_probability=0.1, occlusions=(Occlusion("robot1", 11.0, 12.0),))
    seen, hidden = capture(system, [circle(), circle("robot1")], np.random.default_rng(1))
    span = (hidden.times_s >= 1.0) & (hidden.times_s < 2.0)
    assert not hidden.valid[span].any()
    assert np.isnan(hidden.positions[~hidden.valid]).all()
    assert (~seen.valid).mean() == pytest.approx(0.1, abs=0.05)
    assert seen.valid[span].any()


def test_a_recording_comes_back_from_its_files_with_its_gaps(tmp_path):
    system = MotionCapture(dropout_probability=0.1, occlusions=(Occlusion("robot1", 11.0, 12.0),))
    tracks = capture(system, [circle(), circle("robot1")], np.random.default_rng(1))
    paths = write_tum_files(tracks, tmp_path)
    assert [path.name for path in paths] == ["robot0.tum", "robot1.tum"]
    for track, path in zip(tracks, paths, strict=True):
        (back,) = read_log(path).tracks
        assert back.name == track.name
        assert back.valid.all()
        assert back.times_s == pytest.approx(track.times_s[track.valid], abs=1e-6)
        assert back.positions == pytest.approx(track.positions[track.valid], abs=1e-6)
        assert wrapped(back.headings_rad - track.headings_rad[track.valid]) == pytest.approx(0, abs=1e-5)
    assert np.diff(read_log(paths[1]).tracks[0].times_s).max() == pytest.approx(1.0, abs=0.1)


def test_a_track_without_headings_cannot_become_a_pose_file(tmp_path):
    bare = Track("robot0", np.arange(2.0), np.zeros((2, 2)), np.ones(2, dtype=bool))
    with pytest.raises(MtmError, match="lacks headings"):
        write_tum(bare, tmp_path / "robot0.tum")
    assert not list(tmp_path.iterdir())


def test_no_robot_is_nothing_to_record():
    with pytest.raises(MtmError, match="no robot"):
        capture(MotionCapture(), [], np.random.default_rng(1))
