from functools import cache

import cv2
import numpy as np
import pytest

from hil.worlds import football
from hil.worlds.football import LIMIT, MEAN_DISTANCE, SCORED, Football
from hil.worlds.football_pictures import PICTURE_PX, TEAM_BGR, draw
from hil.worlds.football_team import STRATEGIES, GameState, Team, strategies
from mtm_onboard.protocol import MtmError

torch = pytest.importorskip("torch")
pytest.importorskip("vmas")

pytestmark = pytest.mark.long

TICKS = 20
SEEDS = (3, 4, 5)
# A metre in pixels.
SCALE_PX = 800 / 2.88


def noise(sigma):
    return sigma * np.random.default_rng(1).standard_normal((len(SEEDS), 1, TICKS, 6))


@cache
def played(sigma):
    return Football().run(np.arange(len(SEEDS))[:, None], noise(sigma), SEEDS)


def sight(own_xy_m, ball_xy_m=(0.0, 0.0), games=STRATEGIES):
    own = np.tile(np.asarray(own_xy_m, dtype=float), (games, 1, 1))
    ball = np.tile(np.asarray(ball_xy_m, dtype=float), (games, 1))
    return GameState(own, np.zeros_like(own), ball, np.zeros_like(ball))


def kicked_off(places_m):
    """A state with the three of the team at these places and everyone else out of their way."""
    return np.concatenate([np.ravel(places_m), [1.2, 0.6, 1.2, 0.0, 1.2, -0.6], [0.0, 0.5]])


def test_a_rollout_is_one_shot_with_a_frame_before_each_tick():
    (shot,) = played(0.3)[0].shots
    assert shot.first_tick == 0
    assert np.allclose(shot.times_s, np.arange(TICKS + 1) / 10)
    assert shot.states.shape == (TICKS + 1, 14)


def test_the_same_call_gives_the_same_rollouts():
    again = Football().run(np.arange(3)[:, None], noise(0.3), SEEDS)
    for first, second in zip(played(0.3), again, strict=True):
        assert np.array_equal(first.shots[0].states, second.shots[0].states)


def test_noise_is_added_to_every_action_and_then_clamped():
    for rollout, own in zip(played(0.3), noise(0.3), strict=True):
        control = rollout.control
        assert np.allclose(control.requested - control.base, own[0])
        assert np.array_equal(control.applied, np.clip(control.requested, -LIMIT, LIMIT))
        assert np.abs(control.requested).max() > LIMIT


def test_without_noise_nothing_is_clamped():
    for rollout in played(0.0):
        assert np.array_equal(rollout.control.base, rollout.control.applied)


def test_noise_moves_the_agents_from_the_second_frame_on():
    clean, noisy = played(0.0)[0].shots[0].states, played(0.3)[0].shots[0].states
    assert np.array_equal(clean[0], noisy[0])
    assert np.all(np.any(clean[1, :6].reshape(3, 2) != noisy[1, :6].reshape(3, 2), axis=1))
    assert np.array_equal(clean[1, 6:12], noisy[1, 6:12])


def test_nobody_leaves_the_pitch_or_is_too_fast():
    states = np.stack([rollout.shots[0].states for rollout in played(0.3)])
    places_m = states.reshape(len(SEEDS), TICKS + 1, 7, 2)
    assert np.abs(places_m[..., 0]).max() < 1.6
    assert np.abs(places_m[..., 1]).max() < 0.75
    ways_m = np.linalg.norm(np.diff(places_m[:, :, :6], axis=1), axis=-1)
    assert ways_m.max() < 0.0151


def test_after_a_goal_play_goes_on_from_a_kick_off(monkeypatch):
    kick_off = football._environment

    def just_before_a_goal(count, seed):
        env = kick_off(count, seed)
        env.scenario.ball.set_pos(torch.tensor([1.49, 0.0]), batch_index=1)
        env.scenario.ball.set_vel(torch.tensor([0.3, 0.0]), batch_index=1)
        return env

    monkeypatch.setattr(football, "_environment", just_before_a_goal)
    rollouts = Football().run(np.zeros((3, 1), dtype=int), noise(0.0), SEEDS)
    assert [rollout.control.scores[SCORED] for rollout in rollouts] == [0.0, 1.0, 0.0]
    states = rollouts[1].shots[0].states
    (jump,) = np.flatnonzero(np.linalg.norm(np.diff(states[:, 12:], axis=0), axis=1) > 0.5)
    after = states[jump + 1].reshape(7, 2)
    assert jump < TICKS - 1
    assert np.all(after[:3, 0] < 0.0)
    assert np.all(after[3:6, 0] > -0.05)
    assert np.array_equal(after[6], (0.0, 0.0))


def test_the_task_is_measured_by_the_ball_and_the_score():
    for control in Football().perform(noise(0.0)[:, 0], SEEDS):
        assert set(control.scores) == {MEAN_DISTANCE, SCORED}
        assert 0.0 < control.scores[MEAN_DISTANCE] < 3.1
        assert control.scores[SCORED] in (0.0, 1.0)


def test_arrays_that_do_not_belong_together_are_refused():
    world = Football()
    with pytest.raises(MtmError, match="do not belong together"):
        world.run(np.zeros((2, 1), dtype=int), noise(0.0), SEEDS)
    with pytest.raises(MtmError, match="from 0 to 63"):
        world.run(np.full((3, 1), 64), noise(0.0), SEEDS)


def test_no_two_of_the_64_strategies_are_alike():
    chosen = strategies(np.arange(STRATEGIES))
    rows = np.column_stack([chosen.tempos_mps, chosen.biases, chosen.formations_m, chosen.passes_every_s])
    assert STRATEGIES == 64
    assert len(np.unique(rows, axis=0)) == STRATEGIES


def test_every_strategy_moves_its_team_in_its_own_way():
    generator = np.random.default_rng(2)
    team, chosen = Team(STRATEGIES), strategies(np.arange(STRATEGIES))
    actions = []
    # Long enough for passes, which are played every 5 or 15 s.
    for _ in range(60):
        scene = sight(generator.uniform(-0.4, 0.6, (3, 2)))
        moving = GameState(
            scene.own_xy_m, scene.own_mps + generator.uniform(-0.1, 0.1, 2), scene.ball_xy_m, scene.ball_mps
        )
        actions.append(team.actions(chosen, moving))
    flat = np.stack(actions, axis=1).reshape(STRATEGIES, -1)
    assert len(np.unique(np.round(flat, 9), axis=0)) == STRATEGIES
    assert np.abs(flat).max() <= 1.0


def test_who_stands_behind_the_ball_pushes_it_to_the_goal():
    actions = Team(STRATEGIES).actions(strategies(np.arange(STRATEGIES)), sight([(-0.05, 0.0), (-0.9, 0.5), (-1, 0)]))
    assert np.all(actions[:, 0, 0] > 0.5)


def test_the_team_is_seen_in_its_colours_at_its_places():
    places_m = np.array([(-1.0, 0.3), (0.5, -0.4), (0.2, 0.21)])
    (image,) = draw(kicked_off(places_m)[None])
    assert image.shape == (PICTURE_PX[1], PICTURE_PX[0], 3)
    for place_m, bgr in zip(places_m, TEAM_BGR, strict=True):
        rows, columns = np.nonzero(np.all(image == bgr, axis=2))
        expected_px = SCALE_PX * place_m * (1, -1) + (599.5, 399.5)
        # The number hides a little of the upper right of the agent.
        assert abs(columns.mean() - expected_px[0]) < 1.0
        assert abs(rows.mean() - expected_px[1]) < 1.0


def test_the_pictures_are_those_of_the_simulators_own_renderer():
    world = Football()
    shot = played(0.3)[0].shots[0]
    short = type(shot)(0, shot.times_s[:2], shot.states[:2])
    try:
        native = [frame.image for frame in world.native_pictures(short)]
    except MtmError as refusal:
        pytest.skip(str(refusal))
    ours = [frame.image for frame in world.pictures(short)]
    for mine, theirs in zip(ours, native, strict=True):
        different = cv2.absdiff(mine, theirs).max(axis=2) > 40
        assert different.mean() < 0.004
        for bgr in TEAM_BGR:
            centres = [np.argwhere(np.all(image == bgr, axis=2)).mean(axis=0) for image in (mine, theirs)]
            assert np.abs(centres[0] - centres[1]).max() < 0.4
