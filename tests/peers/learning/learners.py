"""Learns with a real stable-baselines3 while a message is in the actions, and prints as JSON what the robots got.

`python learners.py KEY CASE`, where a case is a learner and how the message comes in. Printed are the actions
that each environment got, and what the learner chose where that is known.
"""

import json
import sys
from itertools import count
from pathlib import Path

import gymnasium
import numpy as np
import stable_baselines3
import torch

from mtm_onboard.policies import (
    KeyedActionNoise,
    KeyedGaussian,
    KeyedNoise,
    VectorKeyedActionNoise,
    VectorKeyedNoise,
    add_to_actions,
    register_with_stable_baselines3,
)
from mtm_onboard.protocol import load_key
from mtm_onboard.runtime.modulator import Modulator

torch.set_num_threads(1)
KEY = load_key(Path(sys.argv[1]))


class Point(gymnasium.Env):
    """A point that goes as it is told, in episodes of fifty steps; `got` are its actions."""

    def __init__(self) -> None:
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
        self.observation_space = gymnasium.spaces.Box(-100.0, 100.0, (2,))
        self.got: list[list[float]] = []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._position, self._steps = np.zeros(2, dtype=np.float32), 0
        return self._position.copy(), {}

    def step(self, action):
        self.got.append([float(value) for value in action])
        self._position, self._steps = self._position + np.float32(0.02) * action, self._steps + 1
        return self._position.copy(), -float(np.sum(self._position**2)), False, self._steps >= 50, {}


def keyed(symbol: int, **options) -> KeyedNoise:
    return KeyedNoise([Modulator(KEY.codebook(), "a", (symbol,))], **options)


def still(learner) -> None:
    """Make the learner's own actions zero, so that what is left is what was added."""
    for parameter in learner.policy.parameters():
        torch.nn.init.zeros_(parameter)


def action_noise(name: str, environments: int) -> dict:
    """An off-policy learner that explores with the message; its own action is zero until it first learns."""
    register_with_stable_baselines3()
    points = [Point() for _ in range(environments)]
    noise = KeyedActionNoise(keyed(0))
    if environments > 1:
        noise = VectorKeyedActionNoise(VectorKeyedNoise([keyed(number % 4) for number in range(environments)]))
    vector = stable_baselines3.common.vec_env.DummyVecEnv([lambda point=point: point for point in points])
    learner = getattr(stable_baselines3, name)(
        "MlpPolicy", vector, action_noise=noise, learning_starts=0, buffer_size=2000, train_freq=(200, "step"),
        gradient_steps=1, device="cpu", seed=1,
    )  # fmt: skip
    still(learner)
    learner.learn(200 * environments)
    return {"got": [point.got[:200] for point in points]}


def wrapped(name: str) -> dict:
    """An on-policy learner whose environment adds the message to what it chose."""
    point, chosen = Point(), []

    class Choosing(gymnasium.ActionWrapper):
        def action(self, action):
            chosen.append([float(value) for value in action])
            return action

    environment = Choosing(add_to_actions(point, keyed(1)))
    getattr(stable_baselines3, name)("MlpPolicy", environment, n_steps=100, device="cpu", seed=1).learn(200)
    return {"got": [point.got], "chosen": chosen}


def gaussian() -> dict:
    """A PPO policy whose epsilon is the message; mean and deviation are the policy's own."""
    point = Point()
    learner = stable_baselines3.PPO("MlpPolicy", point, device="cpu", seed=1)
    seen: list[tuple[list[float], list[float]]] = []

    def distribution(observation):
        tensor, _ = learner.policy.obs_to_tensor(observation)
        normal = learner.policy.get_distribution(tensor).distribution
        mean, deviation = normal.mean.detach().numpy()[0], normal.stddev.detach().numpy()[0]
        seen.append((mean.tolist(), deviation.tolist()))
        return mean, deviation

    act = KeyedGaussian(distribution, keyed(1, random=np.random.default_rng(1)))
    observation, _ = point.reset()
    for _ in range(200):
        observation, *_ = point.step(act(observation))
    return {"got": [point.got], "seen": seen}


def vectorised() -> dict:
    """Gymnasium's vector environment, whose step after an episode's end only resets; ticks come from the steps."""
    points, steps = [Point(), Point()], count()
    now = [0]
    environments = gymnasium.vector.SyncVectorEnv(
        [
            lambda point=point, symbol=symbol: add_to_actions(point, keyed(symbol, tick=lambda: now[0]))
            for point, symbol in zip(points, (1, 2), strict=True)
        ]
    )
    environments.reset()
    for now[0] in steps:
        if now[0] == 160:
            break
        environments.step(np.zeros((2, 2), dtype=np.float32))
    return {"got": [point.got for point in points]}


CASES = {
    "TD3": lambda: action_noise("TD3", 1), "TD3 four": lambda: action_noise("TD3", 4),
    "SAC": lambda: action_noise("SAC", 1), "PPO": lambda: wrapped("PPO"), "gaussian": gaussian, "vector": vectorised,
}  # fmt: skip

if __name__ == "__main__":
    print(json.dumps(CASES[sys.argv[2]]()))
