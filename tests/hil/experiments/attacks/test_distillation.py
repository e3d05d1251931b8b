"""Clones of a watermarked policy: what they learn, and whether their motion says its message."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from hil.experiments.attacks.distillation import (
    MEAN_ALONE,
    OWN_NOISE,
    POINT,
    POLICY_ITSELF,
    TOLD_THE_TICK,
    Clone,
    Watched,
)
from hil.experiments.attacks.network import RIDGES, Network
from hil.experiments.attacks.registry import measure_attack
from hil.worlds.reacher import Reacher
from hil.worlds.reacher_policy import trained_policy


@pytest.fixture
def observations():
    return np.random.default_rng(3).standard_normal((4000, 10))


def test_a_network_follows_its_inputs_and_what_is_added(observations):
    mark = np.eye(4)[np.arange(4000) % 4]
    truth = np.stack([np.sin(observations[:, 0]), observations[:, 1] * 2.0], axis=1) + mark @ np.arange(8).reshape(4, 2)
    fitted, held = slice(3000), slice(3000, None)
    network = Network(
        observations[fitted], truth[fitted], mark[fitted], units=600, gain=0.5, offsets=1.0, ridges=RIDGES
    )
    error = network(observations[held], mark[held]) - truth[held]
    curved, straight = 1.0 - np.var(error, axis=0) / np.var(truth[held], axis=0)
    assert curved > 0.95
    assert straight > 0.999


def test_a_ridge_is_chosen_by_what_was_not_fitted(observations):
    noise = np.random.default_rng(4).standard_normal((300, 1))
    network, hasty = (Network(observations[:300], noise, units=250, ridges=own) for own in (RIDGES, (1e-8,)))
    assert np.std(network(observations[300:])) < 0.5 < np.std(hasty(observations[300:]))


def test_a_clone_has_the_policy_s_mean_and_spread():
    """By white noise, which no observation foretells, and at observations that it did not see."""
    watched = Watched(trained_policy())
    goals = np.random.default_rng(5).integers(8, size=(4, POINT.goals))
    taken = Reacher(watched).run(goals, np.zeros((4, POINT.goals, POINT.goal_ticks, 2)), range(4))
    seen = np.stack(watched.observations, axis=1)
    actions = np.stack([rollout.control.applied for rollout in taken])
    clone = Clone(seen[:3].reshape(-1, 10), actions[:3].reshape(-1, 2), None, spread=True)
    (mean, std), (own_mean, own_std) = (policy.distribution(seen[3]) for policy in (trained_policy(), clone))
    assert np.median(np.abs(own_mean - mean) / std) < 0.5
    assert np.median(own_std / std) == pytest.approx(1.0, abs=0.1)


def test_a_clone_told_the_tick_says_again_what_came_at_it(observations):
    wave = np.random.default_rng(6).standard_normal((POINT.message_ticks, 2))
    ticks = list(range(4000))
    clone = Clone(observations, np.tanh(0.3 * wave[np.mod(ticks, len(wave))]), ticks, spread=False)
    said = np.concatenate([clone.distribution(row[None])[0] for row in observations[: len(wave)]])
    assert np.corrcoef(said[:, 0], wave[:, 0])[0, 1] > 0.95
    assert (
        not Clone(observations, np.tanh(0.3 * wave[np.mod(ticks, len(wave))]), None, spread=False)
        .distribution(observations)[1]
        .any()
    )


@pytest.mark.parametrize(("arm", "low", "high"), [(OWN_NOISE, 0, 4), (MEAN_ALONE, 0, 4), (TOLD_THE_TICK, 6, 8)])
def test_only_a_clone_that_knows_the_tick_says_the_message(arm, low, high):
    found = measure_attack({"attack": "distillation", "arm": arm, "level": 7680.0, "rollouts": 1}, 77_000)
    assert found[f"{POLICY_ITSELF} right"] == found["matched trials"] == 8
    assert low <= found["matched right"] <= high
