import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil.sensors.video import write_video
from hil.worlds.noise import keyed_noise
from hil.worlds.schemes import same_scheme
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import Codebook, MtmError

lunar_lander = pytest.importorskip("gymnasium.envs.box2d.lunar_lander")
lander = pytest.importorskip("hil.worlds.lander")
pictures = pytest.importorskip("hil.worlds.lander_pictures")
states = pytest.importorskip("hil.worlds.lander_states")

SECRET = b"not a real secret, only for test"
SCHEME = same_scheme("lunar-lander", 8, 192, 1)
WORLD = lander.LunarLander()


@cache
def rollout(*pads, seed=3):
    """A keyed rollout that says which pads the lander hovers over."""
    noise = keyed_noise(Codebook(SECRET, SCHEME), [[pad] for pad in pads], WORLD.axes)
    return WORLD.run(np.array([pads]), noise.reshape(1, len(pads), -1, 2), [seed])[0]


def bodies(shot):
    return shot.states[:, states.TERRAIN_POINTS :].reshape(len(shot.states), -1, 3)[:, : states.BODIES]


def tracked(frames):
    (track,) = WORLD.tracker().track(frames)
    return track


def scores(track, start_s):
    return rate_searched_scores(Codebook(SECRET, SCHEME), SCHEME.channels[0], glimpse_of_track(track), start_s)


@cache
def drawn(shot_number):
    return tuple(WORLD.pictures(rollout(6, 1).shots[shot_number]))


def test_a_shot_has_a_frame_more_than_ticks():
    first, second = rollout(6, 1).shots
    assert (first.first_tick, second.first_tick) == (0, 192)
    assert first.times_s[0] == pytest.approx(3.0)
    assert second.times_s[0] == pytest.approx(3.0 + 3.84 + 3.0)
    assert np.diff(second.times_s) == pytest.approx(0.02)
    assert len(first.times_s) == len(first.states) == 193


def test_the_lander_hovers_over_its_pad_in_view():
    for shot, pad in zip(rollout(6, 1).shots, (6, 1), strict=True):
        hull = bodies(shot)[:, 0]
        assert hull[-1, 0] == pytest.approx(lander.PADS_X_M[pad], abs=1.5)
        assert np.all(np.abs(hull[:, 1] - lander.HOVER_Y_M) < 1.5)
        assert shot.states[0, : states.TERRAIN_POINTS].max() < hull[:, 1].min() - 1.0


def test_a_rollout_comes_again_from_its_seed_alone():
    again, other = rollout.__wrapped__(6, 1), rollout(6, 1, seed=4)
    assert np.array_equal(again.shots[1].states, rollout(6, 1).shots[1].states, equal_nan=True)
    assert not np.array_equal(other.shots[0].states[0, :11], rollout(6, 1).shots[0].states[0, :11])


def test_the_engines_get_the_noise_within_their_limits():
    control = rollout(6, 1).control
    noise = keyed_noise(Codebook(SECRET, SCHEME), [[6], [1]], WORLD.axes)
    assert control.requested - control.base == pytest.approx(noise)
    assert np.array_equal(control.applied, np.clip(control.requested, -1.0, 1.0))
    assert np.any(control.applied != control.requested)
    assert control.scores["ended goals"] == 0.0


def test_the_motion_is_that_of_the_environment_with_its_flames():
    environment = lunar_lander.LunarLander(render_mode="rgb_array", continuous=True)
    environment.reset(seed=lander._environment_seed([3, 0]))
    for _ in range(lander.WARM_UP_TICKS):
        side, main = lander.hover_action(environment.lander, lander.PADS_X_M[6])
        environment.step(np.array([main, side]))
    for side, main in rollout(6, 1).control.requested[:192]:
        environment.step(np.array([main, side]))
    expected = [(*body.position, body.angle) for body in environment.drawlist]
    assert np.array_equal(bodies(rollout(6, 1).shots[0])[-1], expected)


def test_a_goal_that_gymnasium_ends_is_filmed_to_its_end():
    noise = np.full((1, 1, 150, 2), (0.0, -5.0))
    fallen = WORLD.run(np.array([[0]]), noise, [1])[0]
    assert fallen.control.scores["ended goals"] == 1.0
    assert len(fallen.shots[0].states) == 151


def test_the_pad_is_read_from_the_pictures():
    for number, pad in enumerate((6, 1)):
        start_s = rollout(6, 1).shots[number].times_s[0]
        assert scores(tracked(drawn(number)), start_s).argmax() == pad


def test_software_pictures_decode_as_those_of_gymnasium():
    shot = rollout(6, 1).shots[1]
    ours, theirs = tracked(drawn(1)), tracked(WORLD.native_pictures(shot))
    assert ours.positions == pytest.approx(theirs.positions, abs=0.5)
    start_s = shot.times_s[0]
    assert scores(ours, start_s).argmax() == scores(theirs, start_s).argmax() == 1
    assert scores(ours, start_s) == pytest.approx(scores(theirs, start_s), abs=0.06)


def test_software_pictures_differ_at_edges_only():
    shot = rollout(6, 1).shots[1]
    short = replace(shot, times_s=shot.times_s[60:63], states=shot.states[60:63])
    for ours, theirs in zip(WORLD.pictures(short), WORLD.native_pictures(short), strict=True):
        difference = np.abs(ours.image.astype(int) - theirs.image).max(axis=2)
        assert np.mean(difference > 60) < 0.003
        assert ours.time_s == theirs.time_s


def test_a_video_file_decodes_as_the_pictures_in_memory_do(tmp_path):
    shot = rollout(6, 1).shots[0]
    write_video(drawn(0), tmp_path / "hover.mp4", nominal_rate_hz=50.0)
    filed = tracked(read_frames(tmp_path / "hover.mp4", WORLD.tracker().pixels))
    direct = tracked(drawn(0))
    assert filed.times_s == pytest.approx(direct.times_s, abs=1e-4)
    start_s = shot.times_s[0]
    assert scores(filed, start_s).argmax() == scores(direct, start_s).argmax() == 6
    assert scores(filed, start_s) == pytest.approx(scores(direct, start_s), abs=0.03)


def test_flames_are_drawn_where_the_main_engine_blew_them():
    shot = rollout(6, 1).shots[0]
    flames = shot.states[100, states.TERRAIN_POINTS :].reshape(-1, 3)[states.BODIES :]
    youngest = flames[~np.isnan(flames[:, 0])][np.argmax(flames[~np.isnan(flames[:, 0])][:, 2])]
    column, row = int(youngest[0] * 30.0), 399 - int(youngest[1] * 30.0)
    blue, green, red = drawn(0)[100].image[row, column].astype(int)
    assert red > 1.5 * green
    assert blue == green


def test_native_pictures_without_pygame_say_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MtmError, match="pip install"):
        WORLD.native_pictures(rollout(6, 1).shots[0])


def test_the_engines_are_shut_off_once_both_legs_stand():
    noise = 0.5 * np.random.default_rng(8).standard_normal((1, WORLD.task_ticks, 2))
    (control,) = WORLD.perform(noise, [5])
    assert np.all(control.requested[0] - control.base[0] == pytest.approx(noise[0, 0]))
    assert np.array_equal(control.applied[-1], (0.0, 0.0))
    assert control.scores["episodic return"] > 200.0


def test_a_clean_landing_earns_what_gymnasium_calls_a_solution():
    histories = WORLD.perform(np.zeros((2, WORLD.task_ticks, 2)), [1, 2])
    for control in histories:
        assert control.scores["episodic return"] > 200.0
        assert len(control.base) < WORLD.task_ticks
