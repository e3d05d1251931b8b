"""VMAS's Football, three against three: a team that plays by rules against the simulator's own opponents.

See the paper's appendices "Policy and Controller Details" and "Football: Numerical Results".

The scenario's physics and pitch are VMAS's defaults: agents of a unit mass under forces of up to 0.1 N and no faster
than 0.15 m/s, kick-offs at random places of either half. So are its opponents, but for their strength, which the paper
does not state.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hil.worlds.football_pictures import PICTURE_PX, draw, draw_natively
from hil.worlds.football_team import GOAL_XY_M, STRATEGIES, GameState, Team, strategies
from hil.worlds.world import ControlHistory, Integers, Rollout, Shot
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.tracking.registry import Tracker
from mtm_onboard.protocol import MtmError

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

RATE_HZ = 10.0
# VMAS's default action range.
LIMIT = 1.0
# Of speed, decisions and precision, 1 being VMAS's full strength: the largest tenth at which our team without noise
# scored in every game of a trial, as the paper's does (40 of 40; at 0.6 in 15 of 16, at full strength in none of 24).
OPPONENTS_STRENGTH = 0.5
MEAN_DISTANCE = "mean distance of the ball to the goal, m"
SCORED = "scored"


class Football:
    """The world Football.

    All rollouts of a call are one batch. VMAS draws kick-off places and the opponents' decisions from one stream of
    random numbers for the batch, which is seeded with all seeds of the call: the same call gives the same rollouts, but
    one seed gives another game when it is called together with other seeds.
    """

    name = "football"
    rate_hz = RATE_HZ
    axes = tuple(f"agent{number}.{axis}" for number in range(3) for axis in ("vx", "vy"))
    goals = 1
    choices = STRATEGIES
    task_ticks = 500
    picture_px = PICTURE_PX

    def run(self, goals: Integers, noise: Floats, seeds: Sequence[int]) -> list[Rollout]:
        """One rollout of one shot for each seed, which plays one strategy after the other, kick-offs included.

        Raises MtmError when the arrays disagree or a strategy does not exist.
        """
        _check(goals, noise, seeds)
        states, histories = _play(np.repeat(goals, noise.shape[2], axis=1), noise.reshape(len(seeds), -1, 6), seeds)
        times_s = np.arange(states.shape[1]) / RATE_HZ
        return [Rollout((Shot(0, times_s, own),), control) for own, control in zip(states, histories, strict=True)]

    def perform(self, noise: Floats, seeds: Sequence[int]) -> list[ControlHistory]:
        """Commands and scores of a game by a strategy of the seed; `SCORED` is 1 if the team scored, else 0."""
        drawn = np.array([[np.random.default_rng(seed).integers(STRATEGIES)] for seed in seeds])
        _check(drawn, noise[:, None], seeds)
        return _play(np.repeat(drawn, noise.shape[1], axis=1), noise, seeds)[1]

    def pictures(self, shot: Shot) -> Iterator[Frame]:
        """Drawn as VMAS's viewer draws the scenario by default, but for the colours of the team."""
        for time_s, image in zip(shot.times_s, draw(shot.states), strict=True):
            yield Frame(float(time_s), image)

    def native_pictures(self, shot: Shot) -> Iterator[Frame]:
        """Drawn by VMAS's viewer; raises MtmError when there is neither EGL nor a display for it."""
        for time_s, image in zip(shot.times_s, draw_natively(_environment(1, 0), shot.states), strict=True):
            yield Frame(float(time_s), image)

    def tracker(self) -> Tracker:
        """By hue, and without the jumps of kick-offs."""
        from mtm_audit.tracking.football import FootballTracker

        return FootballTracker()


def _check(goals: Integers, noise: Floats, seeds: Sequence[int]) -> None:
    if not len(seeds) == len(goals) == len(noise) or noise.shape[1] != goals.shape[1] or noise.shape[-1] != 6:
        raise MtmError(
            f"goals {goals.shape}, noise {noise.shape} and {len(seeds)} seeds do not belong together; give one row of "
            "goals and one of noise for each seed, and six axes"
        )
    if goals.size and not (goals.min() >= 0 and goals.max() < STRATEGIES):
        raise MtmError(f"strategies are numbers from 0 to {STRATEGIES - 1}; leave out {goals.min()} to {goals.max()}")


def _play(numbers: Integers, noise: Floats, seeds: Sequence[int]) -> tuple[Floats, list[ControlHistory]]:
    """States (rollouts, ticks + 1, 14) and histories; `numbers` (rollouts, ticks) are strategies tick by tick."""
    import torch

    count, ticks, _ = noise.shape
    seed = int(np.random.SeedSequence([abs(own) for own in seeds]).generate_state(1)[0])
    env = _environment(count, seed)
    team = Team(count)
    states = np.empty((count, ticks + 1, 14))
    states[:, 0] = _state(env)
    base = np.empty_like(noise)
    away_m, scored = np.empty((count, ticks)), np.zeros(count)
    asked, sent = np.empty_like(noise), np.empty_like(noise)
    for tick in range(ticks):
        base[:, tick] = team.actions(strategies(numbers[:, tick]), _game_state(env)).reshape(count, 6)
        asked[:, tick] = base[:, tick] + noise[:, tick]
        sent[:, tick] = np.clip(asked[:, tick], -LIMIT, LIMIT)
        actions = torch.tensor(sent[:, tick].reshape(count, 3, 2), dtype=torch.float32)
        _, rewards, over, _ = env.step(list(actions.unbind(1)))
        away_m[:, tick] = np.linalg.norm(np.asarray(env.scenario.ball.state.pos) - GOAL_XY_M, axis=1)
        scored = np.maximum(scored, np.asarray(rewards[0]) > 0)
        for row in np.flatnonzero(np.asarray(over)):
            env.reset_at(int(row), return_observations=False)
        states[:, tick + 1] = _state(env)
    return states, [
        ControlHistory(
            base[row], asked[row], sent[row], {MEAN_DISTANCE: float(away_m[row].mean()), SCORED: float(scored[row])}
        )
        for row in range(count)
    ]


def _environment(count: int, seed: int) -> "Environment":
    """The scenario without its observations, shaped rewards and statistics, none of which are used."""
    import torch
    from vmas import make_env
    from vmas.scenarios.football import Scenario

    class Match(Scenario):  # type: ignore[misc]
        def observation(self, agent: object) -> object:
            return self.ball.state.pos

        def info(self, agent: object) -> dict[str, object]:
            return {}

    torch.set_num_threads(1)
    return make_env(
        Match(), num_envs=count, device="cpu", continuous_actions=True, seed=seed, dense_reward=False,
        ai_strength=OPPONENTS_STRENGTH, ai_decision_strength=OPPONENTS_STRENGTH,
        ai_precision_strength=OPPONENTS_STRENGTH,
    )  # fmt: skip


def _game_state(env: "Environment") -> GameState:
    scenario = env.scenario
    return GameState(
        np.stack([np.asarray(agent.state.pos, dtype=np.float64) for agent in scenario.blue_agents], axis=1),
        np.stack([np.asarray(agent.state.vel, dtype=np.float64) for agent in scenario.blue_agents], axis=1),
        np.asarray(scenario.ball.state.pos, dtype=np.float64),
        np.asarray(scenario.ball.state.vel, dtype=np.float64),
    )


def _state(env: "Environment") -> Floats:
    scenario = env.scenario
    bodies = [*scenario.blue_agents, *scenario.red_agents, scenario.ball]
    return np.concatenate([np.asarray(body.state.pos, dtype=np.float64) for body in bodies], axis=1)
