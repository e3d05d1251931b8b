"""VMAS's Discovery with one agent: it visits one goal after the other under a scripted navigation controller.

See the paper's appendices "Policy and Controller Details" and "Discovery: Numerical Results".

The scenario's physics are VMAS's own: a unit mass under a force, and drag that takes off a quarter of its velocity
every tick. A velocity command becomes the force under which the agent settles to that velocity, so that it follows
its command with a lag of a few ticks.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hil.worlds.discovery_pictures import AGENT_COLOUR, PICTURE_PX, draw, draw_natively
from hil.worlds.world import ControlHistory, Integers, Rollout, Shot
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.tracking.registry import Tracker
from mtm_onboard.protocol import MtmError

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

RATE_HZ = 10.0
UNIT_SPEED_MPS = 1.0
# VMAS's default action range.
LIMIT_MPS = 1.0
# VMAS takes off the drag before the first of two half steps: under a unit force the agent settles to 0.35 m/s in the
# first and 0.4 m/s in the second.
FORCE_PER_MPS = 1.0 / 0.375
# The paper says of the arrival only that it leaves 0.24 m to the goal (a target's covering range is 0.25 m). A
# controller that halts dead puts so much of its own motion into the band that it loses half of the messages in short
# windows; so it slows down, and the lag carries the agent on from where the command ends to what the paper measured.
ARRIVAL_M = 0.33
ARRIVAL_GAIN_PER_S = 2.0
FINAL_DISTANCE = "final distance to goal, m"

GOALS = 8
_RING_M = 0.7
_ANGLES_RAD = 2.0 * np.pi * np.arange(GOALS) / GOALS
# On a ring, so that covering ranges do not overlap and the way between two goals is clear of the others.
GOAL_LOCATIONS_M = _RING_M * np.stack([np.cos(_ANGLES_RAD), np.sin(_ANGLES_RAD)], axis=1)

# The agent begins anywhere in here, but no closer to a goal than VMAS lets its entities begin. It can nowhere get so
# far out that VMAS's camera would zoom out to keep it in view.
_START_M = 0.8
_START_DISTANCE_M = 0.2


@dataclass(frozen=True)
class Tick:
    """What stands between the computer and the motors in one tick of a batch of rollouts, (rollouts, 2) each.

    `base_mps` is the controller's command, `requested_mps` the same with the noise, `positions_m` where the agents are.
    """

    number: int
    base_mps: Floats
    requested_mps: Floats
    positions_m: Floats


# What goes to the motors in the place of what was requested.
Tamper = Callable[[Tick], Floats]


class Discovery:
    """The world Discovery; nothing but the start is random."""

    name = "discovery"
    rate_hz = RATE_HZ
    axes = ("agent.vx", "agent.vy")
    goals = 8
    choices = GOALS
    task_ticks = 120
    picture_px = PICTURE_PX

    def run(self, goals: Integers, noise: Floats, seeds: Sequence[int]) -> list[Rollout]:
        """One rollout of one shot for each seed; raises MtmError when the arrays disagree or a goal does not exist."""
        return self.run_tampered(goals, noise, seeds, lambda tick: tick.requested_mps)

    def run_tampered(self, goals: Integers, noise: Floats, seeds: Sequence[int], tamper: Tamper) -> list[Rollout]:
        """The same with somebody between the computer and the motors, asked once a tick and in order."""
        _check(goals, noise, seeds, self.choices)
        starts_m = np.array([_start(np.random.default_rng(seed)) for seed in seeds])
        ticks = noise.shape[2]
        pursued_m = np.repeat(GOAL_LOCATIONS_M[goals], ticks, axis=1)
        positions_m, histories = _drive(starts_m, pursued_m, noise.reshape(len(seeds), -1, 2), tamper)
        times_s = np.arange(positions_m.shape[1]) / RATE_HZ
        return [
            Rollout((Shot(0, times_s, own_m),), control) for own_m, control in zip(positions_m, histories, strict=True)
        ]

    def perform(self, noise: Floats, seeds: Sequence[int]) -> list[ControlHistory]:
        """Commands of a drive to one goal of the seed; the score is the remaining distance at its end."""
        generators = [np.random.default_rng(seed) for seed in seeds]
        starts_m = np.array([_start(generator) for generator in generators])
        goals = np.array([[generator.integers(self.choices)] for generator in generators])
        _check(goals, noise[:, None], seeds, self.choices)
        pursued_m = np.repeat(GOAL_LOCATIONS_M[goals], noise.shape[1], axis=1)
        _, histories = _drive(starts_m, pursued_m, noise, lambda tick: tick.requested_mps)
        return histories

    def pictures(self, shot: Shot) -> Iterator[Frame]:
        """Drawn as VMAS's viewer draws the scenario by default, with the rays of the agent's lidar."""
        for time_s, image in zip(shot.times_s, draw(shot.states, GOAL_LOCATIONS_M), strict=True):
            yield Frame(float(time_s), image)

    def native_pictures(self, shot: Shot) -> Iterator[Frame]:
        """Drawn by VMAS's viewer; raises MtmError when there is neither EGL nor a display for it."""
        env = _environment(1)
        for time_s, image in zip(shot.times_s, draw_natively(env, shot.states), strict=True):
            yield Frame(float(time_s), image)

    def tracker(self) -> Tracker:
        """The centroid of the agent's colour, which the rays of its lidar cut into sectors."""
        from mtm_audit.tracking.centroid import CentroidTracker

        return CentroidTracker(AGENT_COLOUR, name="agent")


def _check(goals: Integers, noise: Floats, seeds: Sequence[int], choices: int) -> None:
    if not len(seeds) == len(goals) == len(noise) or noise.shape[1] != goals.shape[1] or noise.shape[-1] != 2:
        raise MtmError(
            f"goals {goals.shape}, noise {noise.shape} and {len(seeds)} seeds do not belong together; give one row of "
            "goals and one of noise for each seed, and two axes"
        )
    if goals.size and not (goals.min() >= 0 and goals.max() < choices):
        raise MtmError(f"goals are numbers from 0 to {choices - 1}; leave out {goals.min()} to {goals.max()}")


def _start(generator: np.random.Generator) -> Floats:
    while True:
        start_m = generator.uniform(-_START_M, _START_M, 2)
        if np.linalg.norm(GOAL_LOCATIONS_M - start_m, axis=1).min() >= _START_DISTANCE_M:
            return np.asarray(start_m)


def _drive(starts_m: Floats, goals_m: Floats, noise: Floats, tamper: Tamper) -> tuple[Floats, list[ControlHistory]]:
    """Positions (rollouts, ticks + 1, 2) and histories of one batch; `goals_m` and `noise` are (rollouts, ticks, 2)."""
    import torch

    env = _environment(len(starts_m))
    agent = env.world.agents[0]
    agent.set_pos(torch.tensor(starts_m, dtype=torch.float32), batch_index=None)
    agent.set_vel(torch.zeros(starts_m.shape), batch_index=None)
    positions_m = [_numbers(agent.state.pos)]
    base, sent = np.empty_like(noise), np.empty_like(noise)
    for tick in range(noise.shape[1]):
        base[:, tick] = _steer(positions_m[-1], goals_m[:, tick])
        asked_mps = base[:, tick] + noise[:, tick]
        driven_mps = tamper(Tick(tick, base[:, tick], asked_mps, positions_m[-1]))
        sent[:, tick] = np.clip(driven_mps, -LIMIT_MPS, LIMIT_MPS)
        agent.action.u = torch.tensor(FORCE_PER_MPS * sent[:, tick], dtype=torch.float32)
        env.scenario.env_process_action(agent)
        env.world.step()
        positions_m.append(_numbers(agent.state.pos))
    track_m = np.stack(positions_m, axis=1)
    asked = base + noise
    left_m = np.linalg.norm(track_m[:, -1] - goals_m[:, -1], axis=1)
    return track_m, [
        ControlHistory(base[row], asked[row], sent[row], {FINAL_DISTANCE: float(left_m[row])})
        for row in range(len(noise))
    ]


def _steer(positions_m: Floats, goals_m: Floats) -> Floats:
    """Towards the goals at unit speed, slower as they come near, and nothing once they are reached."""
    ways_m = goals_m - positions_m
    lengths_m = np.linalg.norm(ways_m, axis=1, keepdims=True)
    speeds_mps = np.clip(ARRIVAL_GAIN_PER_S * (lengths_m - ARRIVAL_M), 0.0, UNIT_SPEED_MPS)
    return np.asarray(speeds_mps * ways_m / np.maximum(lengths_m, ARRIVAL_M))


def _environment(rollouts: int) -> "Environment":
    """The scenario with its targets at the goals; two agents would be needed to cover one, so none ever moves."""
    import torch
    import vmas

    torch.set_num_threads(1)
    env = vmas.make_env(
        "discovery", num_envs=rollouts, device="cpu", continuous_actions=True, seed=0, n_agents=1, n_targets=GOALS
    )
    for target, location_m in zip(env.world.landmarks, GOAL_LOCATIONS_M, strict=True):
        target.set_pos(torch.tensor(location_m, dtype=torch.float32).expand(rollouts, 2), batch_index=None)
    return env


def _numbers(tensor: object) -> NDArray[np.float64]:
    return np.asarray(tensor, dtype=np.float64)
