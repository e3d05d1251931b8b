"""Discovery: its rollouts, and what is read from its pictures."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("vmas")

from hil.sensors.video import write_video
from hil.worlds.discovery import ARRIVAL_M, FINAL_DISTANCE, GOAL_LOCATIONS_M, Discovery
from hil.worlds.noise import keyed_noise
from hil.worlds.schemes import same_scheme
from hil.worlds.world import Rollout
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import Codebook, MtmError

pytestmark = pytest.mark.long

SECRET = b"not a real secret, only for test"
TICKS = 72
WORLD = Discovery()


def _noise(rollouts: int, goals: int, ticks: int) -> Floats:
    return np.asarray(0.03 * np.random.default_rng(1).standard_normal((rollouts, goals, ticks, 2)))


def _states(rollout: Rollout) -> Floats:
    (shot,) = rollout.shots
    return shot.states


def _codebook() -> Codebook:
    return Codebook(SECRET, same_scheme("discovery", 8, TICKS, 1))


def _sending(numbers: list[int]) -> Rollout:
    """One rollout that says which goal it is on its way to."""
    noise = keyed_noise(_codebook(), [(number,) for number in numbers], WORLD.axes)
    return WORLD.run(np.array([numbers]), noise.reshape(1, len(numbers), TICKS, 2), [3])[0]


def _read(frames: Iterable[Frame], messages: int) -> list[int]:
    codebook = _codebook()
    (track,) = WORLD.tracker().track(frames)
    glimpse, channel = glimpse_of_track(track), codebook.scheme.channels[0]
    onsets_s = np.arange(messages) * TICKS / WORLD.rate_hz
    return [int(np.argmax(rate_searched_scores(codebook, channel, glimpse, onset_s))) for onset_s in onsets_s]


def _pixels(states: Floats) -> Floats:
    """Where the viewer of two metres shows a place, pixel centres being whole numbers and y pointing up."""
    return (states + 1.0) * 352.0 - 0.5


def test_a_seed_gives_the_same_rollout_in_every_batch() -> None:
    goals, noise = np.array([[1, 5], [2, 7], [0, 3]]), _noise(3, 2, 30)
    together = WORLD.run(goals, noise, [7, 8, 9])
    alone = WORLD.run(goals[2:], noise[2:], [9])
    assert np.array_equal(_states(together[2]), _states(alone[0]))
    assert not np.array_equal(_states(together[0])[0], _states(together[1])[0])


def test_goals_are_reached_within_forty_eight_ticks() -> None:
    goals = np.array([[0, 4, 6, 3]])
    states = _states(WORLD.run(goals, np.zeros((1, 4, 48, 2)), [0])[0])
    ends_m = states[48::48]
    assert np.all(np.linalg.norm(ends_m - GOAL_LOCATIONS_M[goals[0]], axis=1) < ARRIVAL_M + 0.01)


def test_the_agent_goes_at_the_speed_of_the_command() -> None:
    rollout = WORLD.run(np.array([[0, 4]]), np.zeros((1, 2, 40, 2)), [0])[0]
    speeds_mps = np.linalg.norm(np.diff(_states(rollout), axis=0), axis=1) * WORLD.rate_hz
    assert speeds_mps.max() == pytest.approx(1.0, abs=0.15)
    assert np.linalg.norm(rollout.control.base, axis=1).max() == pytest.approx(1.0)


def test_noise_comes_upon_the_command_and_the_limit_upon_both() -> None:
    noise = np.full((1, 1, 20, 2), -1.2)
    control = WORLD.run(np.array([[6]]), noise, [0])[0].control
    assert np.allclose(control.requested - control.base, -1.2)
    assert np.array_equal(control.applied, np.clip(control.requested, -1.0, 1.0))
    assert np.any(control.applied != control.requested)


def test_the_agent_stays_where_the_camera_need_not_zoom_out() -> None:
    goals = np.random.default_rng(2).integers(0, 8, (8, 4))
    rollouts = WORLD.run(goals, _noise(8, 4, 48), range(8))
    assert max(np.abs(_states(rollout)).max() for rollout in rollouts) < 0.9


def test_the_task_leaves_the_distance_of_the_paper() -> None:
    silent = np.zeros((10, WORLD.task_ticks, 2))
    for noise in (silent, _noise(10, 1, WORLD.task_ticks)[:, 0]):
        left_m = [control.scores[FINAL_DISTANCE] for control in WORLD.perform(noise, range(10))]
        assert np.mean(left_m) == pytest.approx(0.24, abs=0.05)


@pytest.mark.parametrize("goals", [np.array([[8]]), np.array([[-1]]), np.array([[1, 2]]), np.array([[1], [2]])])
def test_goals_that_do_not_exist_or_fit_the_noise_are_refused(goals: np.ndarray) -> None:
    with pytest.raises(MtmError):
        WORLD.run(goals, np.zeros((1, 1, 10, 2)), [0])


def test_pictures_show_the_agent_where_it_is_at_the_time() -> None:
    (shot,) = WORLD.run(np.array([[4]]), _noise(1, 1, 48), [1])[0].shots
    frames = list(WORLD.pictures(shot))
    assert {frame.size for frame in frames} == {WORLD.picture_px}
    (track,) = WORLD.tracker().track(frames)
    assert track.name == "agent"
    assert track.valid.all()
    assert np.array_equal(track.times_s, np.arange(49) / 10)
    assert np.abs(track.positions - _pixels(shot.states)).max() < 1.0


def test_the_tracker_finds_the_agent_after_it_was_out_of_sight() -> None:
    (shot,) = WORLD.run(np.array([[4]]), _noise(1, 1, 48), [1])[0].shots
    frames = list(WORLD.pictures(shot))
    for number in range(10, 30):
        frames[number] = Frame(frames[number].time_s, np.full_like(frames[number].image, 255))
    (track,) = WORLD.tracker().track(frames)
    assert not track.valid[10:30].any()
    assert track.valid[30:].all()


def test_pictures_without_the_agent_are_refused() -> None:
    with pytest.raises(MtmError, match="nothing of the colour #4040bf"):
        WORLD.tracker().track([Frame(0.0, np.full((704, 704, 3), 255, dtype=np.uint8))])


def test_a_video_file_reads_as_the_pictures_do(tmp_path: Path) -> None:
    numbers = [5, 2]
    (shot,) = _sending(numbers).shots
    write_video(WORLD.pictures(shot), tmp_path / "discovery.mp4", nominal_rate_hz=WORLD.rate_hz)
    assert _read(WORLD.pictures(shot), len(numbers)) == numbers
    assert _read(read_frames(tmp_path / "discovery.mp4", "bgr"), len(numbers)) == numbers


def test_pictures_by_the_simulator_look_and_read_alike() -> None:
    numbers = [5]
    (shot,) = _sending(numbers).shots
    try:
        native = list(WORLD.native_pictures(shot))
    except MtmError as missing:
        pytest.skip(str(missing))
    drawn = list(WORLD.pictures(shot))
    differences = np.abs(native[40].image.astype(float) - drawn[40].image)
    assert differences.mean() < 2.0
    assert _read(native, len(numbers)) == _read(drawn, len(numbers)) == numbers
