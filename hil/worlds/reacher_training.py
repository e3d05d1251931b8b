"""Trains the stochastic policy of the Reacher world and writes the weights of its actor.

    python -m hil.worlds.reacher_training --steps 190000 --seed 42 --out hil/worlds/reacher_policy.npz

needs stable-baselines3 (with torch), gymnasium and mujoco; running the policy needs none of them but mujoco.
Soft actor-critic as in the paper's appendix on policies: 1.9e5 steps, targets within 0.20 m in each axis, the paper's
dense reward with 0.1 |action|^2. The arm starts in any pose rather than near its rest pose.
"""

import argparse
from pathlib import Path

import numpy as np
import torch
from gymnasium.envs.mujoco.reacher_v5 import ReacherEnv
from gymnasium.wrappers import TimeLimit
from stable_baselines3 import SAC

from mtm_onboard.protocol.atomicfile import replacing

TARGET_REACH_M = 0.20
EPISODE_STEPS = 50
ANY_POSE_RAD = (np.pi, 2.5)


class SquareTargets(ReacherEnv):
    """Gymnasium's Reacher from any pose, with targets anywhere in a square rather than in a disc.

    An arm that goes from target to target starts each time where the last one was, not near the rest pose.
    """

    def reset_model(self) -> np.ndarray:
        """Draw a pose and a target in the square."""
        qpos = self.init_qpos.copy()
        qpos[:2] = self.np_random.uniform(np.negative(ANY_POSE_RAD), ANY_POSE_RAD)
        qpos[-2:] = self.goal = self.np_random.uniform(-TARGET_REACH_M, TARGET_REACH_M, size=2)
        qvel = self.init_qvel + self.np_random.uniform(-0.005, 0.005, size=self.model.nv)
        qvel[-2:] = 0.0
        self.set_state(qpos, qvel)  # type: ignore[no-untyped-call]
        return np.asarray(self._get_obs())  # type: ignore[no-untyped-call]


def train(steps: int, seed: int) -> dict[str, np.ndarray]:
    """Train for `steps` steps; returns the actor's layers by name, weights (inputs, outputs) and biases."""
    torch.set_num_threads(1)
    environment = TimeLimit(SquareTargets(reward_control_weight=0.1), EPISODE_STEPS)
    sizes = {"pi": [64, 64], "qf": [256, 256]}
    model = SAC("MlpPolicy", environment, seed=seed, policy_kwargs={"net_arch": sizes}, verbose=1, device="cpu")
    model.learn(total_timesteps=steps, log_interval=100)
    actor = model.actor
    layers = {"hidden0": actor.latent_pi[0], "hidden1": actor.latent_pi[2], "mean": actor.mu, "log_std": actor.log_std}
    arrays: dict[str, np.ndarray] = {}
    for name, layer in layers.items():
        arrays[f"{name}_weights"] = layer.weight.detach().numpy().T.astype(np.float32)
        arrays[f"{name}_biases"] = layer.bias.detach().numpy().astype(np.float32)
    return arrays


def main() -> None:
    """Train and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=190_000)
    parser.add_argument("--seed", type=int, default=42)
    parser.add_argument("--out", type=Path, default=Path("hil/worlds/reacher_policy.npz"))
    arguments = parser.parse_args()
    arrays = train(arguments.steps, arguments.seed)
    with replacing(arguments.out) as partial, partial.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


if __name__ == "__main__":
    main()
