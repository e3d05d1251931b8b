"""The paper's Reacher: an arm of two links goes from target to target under a stochastic policy.

See the paper's appendices "Policy and Controller Details" and "Reacher: Numerical Results".

Gymnasium's Reacher-v5 (its own model file, MuJoCo's physics, two steps of 10 ms a tick: 50 Hz) and a policy trained by
soft actor-critic. The policy's action is tanh(mean + std * eps) with eps standard normal, mean and std both functions
of the observation; the keyed noise takes the place of eps. The paper's sigma = 1.0 is read as this unit variance: with
torque noise of standard deviation 1 the return that it reports is impossible, since the penalty alone, 0.1 per squared
unit in either joint, is 10 in 50 steps.
"""

from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Protocol

import mujoco
import numpy as np

from hil.worlds.reacher_pictures import drawn_pictures, rendered_pictures
from hil.worlds.reacher_policy import trained_policy
from hil.worlds.world import ControlHistory, Integers, Rollout, Shot
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.tracking.registry import Tracker

TARGET_RING_M = 0.14
TARGET_REACH_M = 0.20

_FRAME_SKIP = 2
_ACTION_WEIGHT = 0.1
_POSE_BOUNDS_RAD = (np.pi, 2.5)
_RESET_RAD = 0.1
_RESET_RADPS = 0.005
# Streams of random numbers of one seed, so that the start is the same whatever the noise.
_START, _NOISE = 0, 1


class Policy(Protocol):
    """What drives the arm: a Gaussian over actions before the squashing by tanh."""

    def distribution(self, observations: Floats) -> tuple[Floats, Floats]:
        """Means and standard deviations, (n, 2) each, for observations (n, 10); asked once a tick."""
        ...


class Reacher:
    """The arm; goals are eight targets on a ring, counter-clockwise from +x.

    States are inner and outer joint angle (rad) and the target's x and y (m). The policy is Gaussian: on an axis that
    has no keyed noise in a whole rollout, its eps is drawn white from the seed. In a rollout's control history `base`
    is tanh(mean), `requested` is mean + std * eps, and `applied` is tanh of that: nothing is clamped, but large actions
    are squashed towards 1, full torque. `policy` None is the one that was trained.
    """

    name = "reacher"
    rate_hz = 50.0
    axes: tuple[str, ...] = ("arm.inner", "arm.outer")
    goals = 8
    choices = 8
    task_ticks = 50
    picture_px = (480, 480)

    def __init__(self, policy: Policy | None = None) -> None:
        text = resources.files("gymnasium").joinpath("envs/mujoco/assets/reacher.xml").read_text()
        self._model = mujoco.MjModel.from_xml_string(text)
        self._bodies = [self._model.body(name).id for name in ("fingertip", "target")]
        self._policy: Policy = trained_policy() if policy is None else policy

    def run(self, goals: Integers, noise: Floats, seeds: Sequence[int]) -> list[Rollout]:
        """One rollout of one shot for each seed, from a pose of the seed to one target after the other.

        `goals` (rollouts, goals), `noise` (rollouts, goals, ticks, axes) in units of the policy's own standard
        deviation. Score: the mean distance between fingertip and target at the end of each goal's time.
        """
        arms = [self._posed_arm(seed) for seed in seeds]
        ticks = noise.shape[2]
        eps = _policy_noise(noise.reshape(len(seeds), -1, len(self.axes)), seeds)
        angles_rad = goals * (2 * np.pi / self.choices)
        targets_m = TARGET_RING_M * np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)

        for arm, target_m in zip(arms, targets_m[:, 0], strict=True):
            self._aim(arm, target_m)
        states = [np.stack([arm.qpos for arm in arms])]
        driven = []
        misses_m = np.empty(goals.shape)
        for goal in range(goals.shape[1]):
            for arm, target_m in zip(arms, targets_m[:, goal], strict=True):
                self._aim(arm, target_m)
            for tick in range(goal * ticks, (goal + 1) * ticks):
                driven.append(self._tick(arms, eps[:, tick]))
                states.append(np.stack([arm.qpos for arm in arms]))
            misses_m[:, goal] = [self._miss_m(arm) for arm in arms]

        times_s = np.arange(len(states)) / self.rate_hz
        shots = [Shot(0, times_s, path) for path in np.stack(states, axis=1)]
        scores = [{"final distance (m)": float(miss_m.mean())} for miss_m in misses_m]
        histories = _histories(driven, scores)
        return [Rollout((shot,), control) for shot, control in zip(shots, histories, strict=True)]

    def perform(self, noise: Floats, seeds: Sequence[int]) -> list[ControlHistory]:
        """Commands and return of 50 steps from near the rest pose to a target of the seed within 0.20 m in each axis.

        `noise` is (rollouts, 50, axes). Score: the return, the sum of -|fingertip - target| - 0.1 |action|^2.
        """
        arms = [self._resting_arm(seed) for seed in seeds]
        eps = _policy_noise(noise, seeds)
        driven = []
        returns = np.zeros(len(seeds))
        for tick in range(noise.shape[1]):
            driven.append(self._tick(arms, eps[:, tick]))
            returns -= [self._miss_m(arm) for arm in arms]
            returns -= _ACTION_WEIGHT * np.square(driven[-1][2]).sum(axis=1)
        return _histories(driven, [{"50-step return": float(total)} for total in returns])

    def pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot seen from above, drawn by the software camera."""
        return drawn_pictures(shot)

    def native_pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot seen from above, drawn by MuJoCo; raises MtmError when there is no OpenGL to draw with."""
        return rendered_pictures(self._model, shot)

    def tracker(self) -> Tracker:
        """The segmentation of both links by hue: one track of their directions.

        The paper's angular velocity of the outer arm, r x v / |r|^2 with v relative to the elbow, is that of the link
        in the picture, which the inner joint turns as well: that is how the arms interfere in its tables.
        """
        from mtm_audit.tracking.arms import ArmTracker

        return ArmTracker(relative=False)

    def _posed_arm(self, seed: int) -> mujoco.MjData:
        draw = np.random.default_rng([seed, _START])
        arm = mujoco.MjData(self._model)
        arm.qpos[:2] = draw.uniform(np.negative(_POSE_BOUNDS_RAD), _POSE_BOUNDS_RAD)
        return arm

    def _resting_arm(self, seed: int) -> mujoco.MjData:
        draw = np.random.default_rng([seed, _START])
        arm = mujoco.MjData(self._model)
        arm.qpos[:2] = draw.uniform(-_RESET_RAD, _RESET_RAD, 2)
        arm.qvel[:2] = draw.uniform(-_RESET_RADPS, _RESET_RADPS, 2)
        self._aim(arm, draw.uniform(-TARGET_REACH_M, TARGET_REACH_M, 2))
        return arm

    def _aim(self, arm: mujoco.MjData, target_xy_m: Floats) -> None:
        arm.qpos[2:] = target_xy_m
        mujoco.mj_forward(self._model, arm)

    def _tick(self, arms: Sequence[mujoco.MjData], eps: Floats) -> tuple[Floats, Floats, Floats]:
        """One control period of all arms; the means' actions, the actions before and after tanh: (arms, axes) each."""
        mean, std = self._policy.distribution(np.stack([self._observation(arm) for arm in arms]))
        asked = mean + std * eps
        sent = np.tanh(asked)
        for arm, action in zip(arms, sent, strict=True):
            arm.ctrl[:] = action
            mujoco.mj_step(self._model, arm, nstep=_FRAME_SKIP)
        return np.tanh(mean), asked, sent

    def _observation(self, arm: mujoco.MjData) -> Floats:
        """What Reacher-v5 observes, (10,)."""
        joints_rad = arm.qpos[:2]
        observed: Floats = np.concatenate(
            [np.cos(joints_rad), np.sin(joints_rad), arm.qpos[2:], arm.qvel[:2], self._offset_m(arm)]
        )
        return observed

    def _offset_m(self, arm: mujoco.MjData) -> Floats:
        # As in Reacher-v5 the places of a step's last evaluation, not of its end, which the angles belong to.
        fingertip, target = self._bodies
        offset: Floats = (arm.xpos[fingertip] - arm.xpos[target])[:2]
        return offset

    def _miss_m(self, arm: mujoco.MjData) -> float:
        return float(np.linalg.norm(self._offset_m(arm)))


def _histories(
    driven: Sequence[tuple[Floats, Floats, Floats]], scores: Sequence[dict[str, float]]
) -> list[ControlHistory]:
    """From what `_tick` gave in each tick, and the scores of each arm."""
    base, asked, sent = (np.stack(part, axis=1) for part in zip(*driven, strict=True))
    return [ControlHistory(base[arm], asked[arm], sent[arm], own) for arm, own in enumerate(scores)]


def _policy_noise(noise: Floats, seeds: Sequence[int]) -> Floats:
    """`noise` (rollouts, ticks, axes) with white noise of the seed on the axes that have none in their rollout."""
    white = np.stack([np.random.default_rng([seed, _NOISE]).standard_normal(noise.shape[1:]) for seed in seeds])
    return np.where(noise.any(axis=1, keepdims=True), noise, white)
