import numpy as np
import pytest

from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError

HIGHEST_HZ = 5.0


def position(times_s):
    """Two axes of smooth motion inside the band; its velocity follows analytically."""
    return np.stack([0.1 * np.sin(2 * np.pi * 1.3 * times_s), 0.3 * times_s + 0.02 * np.cos(2 * np.pi * 3 * times_s)])


def motion_of(times_s):
    valid = np.ones(len(times_s), dtype=bool)
    return uniform_motion(glimpse_of_track(Track("robot0", times_s, position(times_s).T, valid)), HIGHEST_HZ)


def mean_velocities(motion):
    """The true mean velocities of its cells."""
    edges_s = motion.start_s + np.arange(len(motion.seen) + 1) * motion.step_s
    return np.diff(position(edges_s), axis=1) / motion.step_s


def assert_shows_the_motion(motion, within):
    inner = motion.seen.copy()
    inner[:3] = inner[-3:] = False
    error = (motion.velocities - mean_velocities(motion))[:, inner]
    assert np.abs(error).max() < within * np.abs(mean_velocities(motion)).max()


def test_regular_frames_give_their_own_mean_velocities():
    motion = motion_of(3.0 + np.arange(400) / 25.0)
    assert (motion.start_s, motion.step_s) == (3.0, pytest.approx(0.04))
    assert motion.seen.all()
    assert motion.velocities == pytest.approx(mean_velocities(motion), abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_irregular_frame_times_are_put_on_a_grid(seed):
    rng = np.random.default_rng(seed)
    times_s = np.cumsum(rng.uniform(0.02, 0.045, 600))
    motion = motion_of(times_s)
    assert motion.seen.all()
    assert_shows_the_motion(motion, within=0.03)


def test_many_samples_a_period_are_averaged_over_cells():
    motion = motion_of(np.arange(5000) / 500.0)
    assert motion.step_s == pytest.approx(0.04)
    assert_shows_the_motion(motion, within=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_frames_lost_one_by_one_leave_no_gap(seed):
    times_s = np.arange(900) / 30.0
    kept = np.random.default_rng(seed).random(900) > 0.1
    kept[1:] |= ~kept[:-1]
    motion = motion_of(times_s[kept])
    assert motion.seen.all()
    assert_shows_the_motion(motion, within=0.15)


def test_what_an_occlusion_touches_is_not_seen_and_the_rest_is():
    times_s = np.arange(900) / 30.0
    motion = motion_of(times_s[(times_s < 10.0) | (times_s > 11.0)])
    hidden_s = motion.middles_s[~motion.seen]
    assert hidden_s.min() == pytest.approx(9.967, abs=motion.step_s)
    assert hidden_s.max() == pytest.approx(11.033, abs=motion.step_s)
    assert np.all(np.diff(hidden_s) < 1.5 * motion.step_s)
    assert np.all(motion.velocities[:, ~motion.seen] == 0.0)
    beside = np.minimum(np.abs(motion.middles_s - 9.967), np.abs(motion.middles_s - 11.033)) < 0.15
    inner = motion.seen & ~beside
    inner[:3] = inner[-3:] = False
    assert motion.velocities[:, inner] == pytest.approx(mean_velocities(motion)[:, inner], abs=0.02)


def test_a_recording_of_a_moment_is_refused_with_a_length():
    with pytest.raises(MtmError, match="lasts 0.30 s only; record at least 0.6 s"):
        motion_of(np.arange(16) / 50.0)
