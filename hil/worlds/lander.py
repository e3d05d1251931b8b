"""The Lunar Lander world: Gymnasium's own physics, a hover controller for the pads and a heuristic that lands.

Physics, engine rules and their dispersion are those of Gymnasium's continuous environment, without wind, which is its
default. Lengths are the simulator's metres, of which the picture shows 20 x 13.3; x to the right, y up, angles
counter-clockwise.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from gymnasium.envs.box2d import lunar_lander

from hil.worlds.world import Conduct, Integers, Rollout, Shot
from mtm_audit.recordings.frames import Frame
from mtm_audit.tracking.registry import Tracker
from mtm_audit.tracks import Floats

PADS_X_M = np.linspace(4.5, 15.5, 8)
# High enough that neither terrain (up to 6.6 m) nor flags share the upper rows of the picture with the lander.
HOVER_Y_M = 10.0
# The part of the picture into which neither terrain nor flags reach, as left, upper, right and lower edge.
SKY_PX = (0, 0, 600, 200)
WARM_UP_TICKS = 150

# Columns of a shot's states: the terrain's heights, then x, y and angle of the lander and of its two legs, then x, y
# and remaining life of each particle of the flames, oldest first, NaN where there are fewer.
TERRAIN_POINTS = 11
BODIES = 3
# A particle lives for at most seven pictures, and two are born in a tick.
MOST_PARTICLES = 16

_STREAM = 23
_FADING_PER_PICTURE = 0.15


class LunarLander:
    """One lander hovers over eight pads in turn: each a descent of its own, of which the hover is filmed.

    An environment that Gymnasium ends (by touching the moon or by leaving the picture at a side) is flown on and
    filmed, as nobody could tell the camera to forget it; `run` counts such goals in the score "ended goals".
    """

    name = "lunar-lander"
    rate_hz = float(lunar_lander.FPS)
    axes = ("lander.vx", "lander.vy")
    goals = 8
    choices = len(PADS_X_M)
    task_ticks = 600
    picture_px = (lunar_lander.VIEWPORT_W, lunar_lander.VIEWPORT_H)

    def run(self, goals: Integers, noise: Floats, seeds: Sequence[int]) -> list[Rollout]:
        """Hover over each goal's pad for as many ticks as it has noise: one rollout for each seed.

        `goals` (rollouts, goals) are numbers of pads from left to right; `noise` (rollouts, goals, ticks, 2) is added
        to the side engine's and the main engine's command.
        """
        environment = lunar_lander.LunarLander(continuous=True)
        return [_rollout(environment, pads, added, seed) for pads, added, seed in zip(goals, noise, seeds, strict=True)]

    def perform(self, noise: Floats, seeds: Sequence[int]) -> list[Conduct]:
        """Descend and land between the flags with Gymnasium's heuristic, a proportional-derivative controller.

        The score "episodic return" is the sum of Gymnasium's rewards until it ends the episode or `noise` does.
        """
        environment = lunar_lander.LunarLander(continuous=True)
        return [_landing(environment, added, seed) for added, seed in zip(noise, seeds, strict=True)]

    def pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot drawn like Gymnasium's `rgb_array`, flames included."""
        from hil.worlds.lander_pictures import drawn

        return drawn(shot)

    def native_pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot drawn by Gymnasium itself; raises MtmError when pygame is missing."""
        from hil.worlds.lander_pictures import rendered

        return rendered(shot)

    def tracker(self) -> Tracker:
        """Centroid of what is bright above terrain and flags, smoothed by a constant-velocity Kalman filter."""
        from mtm_audit.tracking.brightness import BrightnessTracker

        return BrightnessTracker(SKY_PX)


def hover_action(body: lunar_lander.Box2D.b2Body, pad_x_m: float) -> tuple[float, float]:
    """Commands of the side and the main engine, each in -1 to 1, that bring the lander over the pad and keep it there.

    The lander goes sideways by leaning: the side engine turns it to the angle asked for.
    """
    (x_m, y_m), (vx_mps, vy_mps) = body.position, body.linearVelocity
    lean_rad = min(max(LEAN_PER_M * (x_m - pad_x_m) + LEAN_PER_MPS * vx_mps, -MOST_LEAN), MOST_LEAN)
    side = TURN_PER_RAD * (body.angle - lean_rad) + TURN_PER_RADPS * body.angularVelocity
    main = HOVER_THROTTLE + LIFT_PER_M * (HOVER_Y_M - y_m) - LIFT_PER_MPS * vy_mps
    return min(max(side, -1.0), 1.0), min(max(main, -1.0), 1.0)


LEAN_PER_M = 0.03
LEAN_PER_MPS = 0.1
MOST_LEAN = 0.3
TURN_PER_RAD = 10.0
TURN_PER_RADPS = 1.0
HOVER_THROTTLE = 0.25
LIFT_PER_M = 0.5
LIFT_PER_MPS = 0.5


def _rollout(environment: lunar_lander.LunarLander, pads: Integers, noise: Floats, seed: int) -> Rollout:
    ticks = noise.shape[1]
    shots, bases, ended = [], [], 0
    for number, pad in enumerate(pads):
        states, base, lost = _descent(environment, float(PADS_X_M[pad]), noise[number], [seed, number])
        first_s = ((number + 1) * WARM_UP_TICKS + number * ticks) / LunarLander.rate_hz
        shots.append(Shot(number * ticks, first_s + np.arange(ticks + 1) / LunarLander.rate_hz, states))
        bases.append(base)
        ended += lost
    return Rollout(tuple(shots), _conduct(np.concatenate(bases), noise.reshape(-1, 2), {"ended goals": float(ended)}))


def _descent(
    environment: lunar_lander.LunarLander, pad_x_m: float, noise: Floats, seed: Sequence[int]
) -> tuple[Floats, Floats, bool]:
    """States (ticks + 1, columns) and base commands (ticks, 2) of one goal, and whether Gymnasium ended it."""
    # Particles do not act on the lander, and off camera nobody sees them.
    environment.render_mode = None
    environment.reset(seed=_environment_seed(seed))
    lost = False
    for _ in range(WARM_UP_TICKS):
        side, main = hover_action(environment.lander, pad_x_m)
        lost |= environment.step(np.array((main, side)))[2]
    environment.render_mode = "rgb_array"
    states, base = [_state(environment)], np.empty_like(noise)
    for tick, added in enumerate(noise):
        base[tick] = hover_action(environment.lander, pad_x_m)
        lost |= environment.step((base[tick] + added)[::-1])[2]
        states.append(_state(environment))
    return np.stack(states), base, lost


def _landing(environment: lunar_lander.LunarLander, noise: Floats, seed: int) -> Conduct:
    environment.render_mode = None
    observation, _ = environment.reset(seed=_environment_seed([seed]))
    base, total = [], 0.0
    for added in noise:
        base.append(lunar_lander.heuristic(environment, observation)[::-1])
        observation, reward, ended, _, _ = environment.step((base[-1] + added)[::-1])
        total += float(reward)
        if ended:
            break
    return _conduct(np.array(base), noise[: len(base)], {"episodic return": total})


def _conduct(base: Floats, noise: Floats, scores: dict[str, float]) -> Conduct:
    asked = base + noise
    return Conduct(base, asked, np.clip(asked, -1.0, 1.0), scores)


def _environment_seed(parts: Sequence[int]) -> int:
    return int(np.random.SeedSequence([_STREAM, *parts]).generate_state(1)[0])


def _state(environment: lunar_lander.LunarLander) -> Floats:
    """One row of states; the flames fade by a picture, which Gymnasium does as it draws them."""
    for particle in environment.particles:
        particle.ttl -= _FADING_PER_PICTURE
    environment._clean_particles(False)
    terrain = [polygon[0][1] for polygon in environment.sky_polys] + [environment.sky_polys[-1][1][1]]
    bodies = [(*body.position, body.angle) for body in environment.drawlist]
    flames = [(*particle.position, particle.ttl) for particle in environment.particles]
    flames += [(math.nan,) * 3] * (MOST_PARTICLES - len(flames))
    return np.concatenate([terrain, np.ravel(bodies), np.ravel(flames)])
