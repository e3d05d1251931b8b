"""The keyed action noise where stable-baselines3 would have its own, with a stand-in of its documented interface."""

import copy
import sys
import types
from abc import ABC, abstractmethod
from itertools import count

import numpy as np
import pytest

from mtm_onboard.policies import (
    KeyedActionNoise,
    KeyedNoise,
    VectorKeyedActionNoise,
    VectorKeyedNoise,
    register_with_stable_baselines3,
)
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import small_codebook


def keyed(symbol=1, first_tick=0) -> KeyedNoise:
    return KeyedNoise([Modulator(small_codebook(), "a", (symbol,))], tick=count(first_tick).__next__)


def added(symbol=1, ticks=range(200)) -> np.ndarray:
    modulator = Modulator(small_codebook(), "a", (symbol,))
    return np.array([0.1 * modulator.perturbation(tick) for tick in ticks], dtype=np.float32)


@pytest.fixture
def stable_baselines3(monkeypatch):
    """The two base classes of stable_baselines3.common.noise."""

    class ActionNoise(ABC):
        def reset(self) -> None:  # noqa: B027 - as the library has it
            pass

        @abstractmethod
        def __call__(self) -> np.ndarray: ...

    class VectorizedActionNoise(ActionNoise):
        def __init__(self, base_noise, n_envs):
            if not isinstance(base_noise, ActionNoise):
                raise TypeError
            self.noises = [copy.deepcopy(base_noise) for _ in range(n_envs)]

        def reset(self, indices=None) -> None:
            for index in range(len(self.noises)) if indices is None else indices:
                self.noises[index].reset()

        def __call__(self) -> np.ndarray:
            return np.stack([noise() for noise in self.noises])

    module = types.ModuleType("stable_baselines3.common.noise")
    module.ActionNoise, module.VectorizedActionNoise = ActionNoise, VectorizedActionNoise
    for name in ("stable_baselines3", "stable_baselines3.common"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module


def learned(library, noise, n_envs, steps, ends=()) -> np.ndarray:
    """What an off-policy algorithm adds to its actions; `ends` are the (step, env) at which episodes end."""
    if n_envs > 1 and not isinstance(noise, library.VectorizedActionNoise):
        noise = library.VectorizedActionNoise(noise, n_envs)
    rows = []
    for step in range(steps):
        rows.append(np.zeros((n_envs, 2), dtype=np.float32) + noise())
        for _, env in (end for end in ends if end[0] == step):
            noise.reset(**(dict(indices=[env]) if n_envs > 1 else {}))
    return np.array(rows)


def test_the_noise_has_the_action_s_shape_and_sigma():
    noise = KeyedActionNoise(keyed())
    row = noise()
    assert (row.shape, row.dtype) == ((2,), np.float32)
    assert np.array_equal(row, added()[0])
    assert "0.1" in repr(noise)


def test_the_end_of_an_episode_does_not_restart_the_message(stable_baselines3):
    rows = learned(stable_baselines3, KeyedActionNoise(keyed()), 1, 200, ends=[(13, 0), (70, 0), (71, 0)])
    assert np.array_equal(rows[:, 0], added())


def test_vectorised_environments_keep_their_own_phases(stable_baselines3):
    register_with_stable_baselines3()
    noise = VectorKeyedActionNoise(VectorKeyedNoise([keyed(), keyed(2, 40)]))
    rows = learned(stable_baselines3, noise, 2, 200, ends=[(13, 0), (70, 1), (71, 0)])
    noise.reset()
    assert rows.dtype == np.float32
    assert np.array_equal(rows[:, 0], added())
    assert np.array_equal(rows[:, 1], added(2, range(40, 240)))


def test_once_registered_the_classes_pass_for_the_library_s_own(stable_baselines3):
    register_with_stable_baselines3()
    one, several = KeyedActionNoise(keyed()), VectorKeyedActionNoise(VectorKeyedNoise([keyed()]))
    assert isinstance(one, stable_baselines3.ActionNoise)
    assert not isinstance(one, stable_baselines3.VectorizedActionNoise)
    assert isinstance(several, stable_baselines3.VectorizedActionNoise)


def test_a_noise_that_would_be_copied_says_what_to_give_instead(stable_baselines3):
    register_with_stable_baselines3()
    with pytest.raises(MtmError, match="one for each environment"):
        learned(stable_baselines3, KeyedActionNoise(keyed()), 2, 1)


def test_without_the_library_registering_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(MtmError, match="pip install stable-baselines3"):
        register_with_stable_baselines3()
