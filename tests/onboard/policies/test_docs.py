"""The page's programs run as they stand, with stand-ins for the model and the learner that they speak of."""

import re
import sys
import types
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from mtm_onboard.cli import main

PAGE = (Path(__file__).parents[3] / "docs" / "policies-and-ros2.md").read_text()


class Arm(gymnasium.Env):
    def __init__(self) -> None:
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (3,))
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(2, dtype=np.float32), {}

    def step(self, action):
        assert self.action_space.contains(action)
        return np.zeros(2, dtype=np.float32), 0.0, False, False, {}


class Tensor(np.ndarray):
    def detach(self):
        return self

    def numpy(self):
        return np.asarray(self)


class Policy:
    """As much of an actor-critic policy as the page uses: a batch of one, of three components."""

    def obs_to_tensor(self, observation):
        return observation[None], False

    def get_distribution(self, tensor):
        normal = types.SimpleNamespace(mean=np.zeros((1, 3)).view(Tensor), stddev=np.full((1, 3), 0.1).view(Tensor))
        return types.SimpleNamespace(distribution=normal)


class ActionNoise:
    register = staticmethod(lambda kind: None)


@pytest.fixture
def libraries(monkeypatch):
    given = []
    learner = types.ModuleType("stable_baselines3")
    learner.TD3 = lambda policy, env, action_noise: given.append(action_noise())
    noise = types.ModuleType("stable_baselines3.common.noise")
    noise.ActionNoise = noise.VectorizedActionNoise = ActionNoise
    for module in (learner, types.ModuleType("stable_baselines3.common"), noise):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    gymnasium.register("Arm-v0", entry_point=Arm)
    yield given
    del gymnasium.registry["Arm-v0"]


def test_the_programs_run_one_after_the_other(tmp_path, monkeypatch, capsys, libraries):
    monkeypatch.chdir(tmp_path)
    keygen = re.search(r"^mtm-onboard (keygen .*?)\n```", PAGE, re.DOTALL | re.MULTILINE).group(1)
    assert main(keygen.replace("\\\n", " ").split()) == 0
    names = {"model": types.SimpleNamespace(policy=Policy())}
    programs = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    for program in programs:
        exec(program, names)
    assert len(programs) == 5
    assert "of 1 actions clipped" in capsys.readouterr().out
    assert names["bounds"].actions == 1
    assert libraries[0].shape == (3,)
    assert names["four"]().shape == (4, 3)
