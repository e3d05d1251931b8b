import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv

from mtm_onboard.policies import KeyedNoise, add_to_actions, gymactions
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import small_codebook


class Point(gymnasium.Env):
    """A point that goes as it is told, in episodes of fifty steps."""

    def __init__(self, bound=1.0, components=2) -> None:
        self.action_space = gymnasium.spaces.Box(-bound, bound, (components,))
        self.observation_space = gymnasium.spaces.Box(-100.0, 100.0, (components,))
        self.got = []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._position, self._steps = np.zeros(self.action_space.shape, dtype=np.float32), 0
        return self._position.copy(), {}

    def step(self, action):
        assert self.action_space.contains(action)
        self.got.append(action)
        self._position, self._steps = self._position + np.float32(0.02) * action, self._steps + 1
        return self._position.copy(), 0.0, False, self._steps >= 50, {}


def keyed(symbol=1) -> KeyedNoise:
    return KeyedNoise([Modulator(small_codebook(), "a", (symbol,))])


def played(ticks, symbol=1) -> np.ndarray:
    modulator = Modulator(small_codebook(), "a", (symbol,))
    return np.array([0.1 * modulator.perturbation(tick) for tick in range(ticks)])


def driven(env, action, steps) -> None:
    env.reset()
    for _ in range(steps):
        if env.step(np.array(action, dtype=np.float32))[3]:
            env.reset()


def test_the_message_goes_on_over_the_episodes():
    env = add_to_actions(Point(), keyed())
    driven(env, [0.3, -0.2], 230)
    assert isinstance(env, gymnasium.ActionWrapper)
    assert np.array(env.unwrapped.got) == pytest.approx(np.array([0.3, -0.2]) + played(230), abs=1e-6)
    assert (env.bounds.actions, env.bounds.clipped) == (230, 0)


def test_what_the_action_space_cuts_is_counted_and_reported():
    env = gymnasium.wrappers.TimeLimit(add_to_actions(Point(0.35), keyed()), 1000)
    driven(env, [0.3, 0.0], 230)
    wanted = np.array([0.3, 0.0]) + played(230)
    cut = np.any(np.abs(wanted) > np.float32(0.35), axis=1)
    assert 0 < np.count_nonzero(cut) < 230
    assert env.get_wrapper_attr("bounds").clipped == np.count_nonzero(cut)
    assert np.array(env.unwrapped.got) == pytest.approx(np.clip(wanted, -0.35, 0.35), abs=1e-6)


def test_environments_that_step_together_have_a_noise_each():
    # Each wrapped on its own, so that each has its own message.
    envs = SyncVectorEnv([lambda symbol=symbol: add_to_actions(Point(), keyed(symbol)) for symbol in (1, 2)])
    driven_together = np.zeros((2, 2), dtype=np.float32)
    envs.reset()
    for _ in range(40):
        envs.step(driven_together)
    for env, symbol in zip(envs.envs, (1, 2), strict=True):
        assert np.array(env.unwrapped.got) == pytest.approx(played(40, symbol), abs=1e-6)


def test_a_step_that_only_resets_takes_its_tick_by_step_count():
    # Gymnasium's vector environments reset in the step after an episode's end, and its action reaches nobody.
    step = 0
    noise = KeyedNoise([Modulator(small_codebook(), "a", (1,))], tick=lambda: step)
    envs = SyncVectorEnv([lambda: add_to_actions(Point(), noise)])
    envs.reset()
    for step in range(153):  # noqa: B007 - the noise reads it
        envs.step(np.zeros((1, 2), dtype=np.float32))
    reached = [tick for tick in range(153) if tick not in (50, 101, 152)]
    assert np.array(envs.envs[0].unwrapped.got) == pytest.approx(played(153)[reached], abs=1e-6)


def test_actions_of_another_kind_are_refused():
    discrete = Point()
    discrete.action_space = gymnasium.spaces.Discrete(3)
    for env in (Point(components=3), discrete):
        with pytest.raises(MtmError, match="the noise has the axes vx, vy"):
            add_to_actions(env, keyed())


def test_the_tiny_environment_is_a_proper_one():
    check_env(Point(), skip_render_check=True)


def test_without_gymnasium_the_wrapper_says_what_to_install(monkeypatch):
    gymactions._wrapper.cache_clear()
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(MtmError, match="pip install gymnasium"):
        add_to_actions(object(), keyed())
