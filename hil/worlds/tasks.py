"""Tasks of a RoboMaster whose motion has other statistics than the paper's zigzag.

All drive the same chassis at its control rate; where they go and when is drawn from the robot's seed.
"""

import math

import numpy as np
from scipy import signal

from hil.worlds.robomaster import GoToGoal, Route, Task, TaskFactory, go_to_goal, heading_held
from mtm_onboard.model.velocity import BodyVelocity

_STREAM = 11
_RATE_HZ = 50.0
_PERIOD_S = 1.0 / _RATE_HZ

Point = tuple[float, float]


class Hover:
    """Holds a point against kicks with thrusters that are on or off, as a lander does: rare, hard jerks."""

    _KICKS_PER_S = 0.7
    _KICK_MPS = 0.3
    _THRUST_MPS2 = 1.2
    _DEAD_ZONE_M = 0.05

    def __init__(self, route: Route, draw: np.random.Generator) -> None:
        self._home_m = route.start_xy_m
        self._draw = draw
        self._velocity_mps = [0.0, 0.0]

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """The velocity after this tick's random kick and the thrust against it."""
        kicked = self._draw.random() < self._KICKS_PER_S * _PERIOD_S
        for axis in range(2):
            velocity = self._velocity_mps[axis]
            if kicked:
                velocity += self._KICK_MPS * self._draw.standard_normal()
            miss_m = self._home_m[axis] - position_xy_m[axis] - 0.8 * velocity
            if abs(miss_m) > self._DEAD_ZONE_M:
                velocity += math.copysign(self._THRUST_MPS2 * _PERIOD_S, miss_m)
            self._velocity_mps[axis] = velocity
        return heading_held(self._velocity_mps[0], self._velocity_mps[1], heading_rad)


class Orbit:
    """Circles smoothly round a point beside the start."""

    _GAIN_PER_S = 1.5

    def __init__(self, route: Route, draw: np.random.Generator) -> None:
        self._radius_m = float(draw.uniform(0.3, 0.8))
        self._turn_radps = float(draw.uniform(0.2, 0.5)) / self._radius_m * float(draw.choice((-1.0, 1.0)))
        angle_rad = float(draw.uniform(0.0, math.tau))
        x_m, y_m = route.start_xy_m
        self._centre_m = (x_m + self._radius_m * math.cos(angle_rad), y_m + self._radius_m * math.sin(angle_rad))

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """The velocity along the circle plus a correction towards it."""
        x_m, y_m = position_xy_m[0] - self._centre_m[0], position_xy_m[1] - self._centre_m[1]
        back_per_s = self._GAIN_PER_S * (self._radius_m / max(math.hypot(x_m, y_m), 1e-6) - 1.0)
        turn_radps = self._turn_radps
        return heading_held(back_per_s * x_m - turn_radps * y_m, back_per_s * y_m + turn_radps * x_m, heading_rad)


class StopAndGo:
    """Drives to one random point after another, and waits at each."""

    _SPEED_MPS = 0.6
    _GAIN_PER_S = 3.0
    _ARRIVAL_M = 0.03

    def __init__(self, route: Route, draw: np.random.Generator) -> None:
        self._start_m = route.start_xy_m
        self._draw = draw
        self._goal_m = self._next_goal()
        self._waits = 0

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """Zero while it waits, otherwise the velocity towards the next point."""
        x_m, y_m = self._goal_m[0] - position_xy_m[0], self._goal_m[1] - position_xy_m[1]
        distance_m = math.hypot(x_m, y_m)
        if self._waits:
            self._waits -= 1
            return heading_held(0.0, 0.0, heading_rad)
        if distance_m < self._ARRIVAL_M:
            self._waits = int(self._draw.uniform(0.2, 1.5) * _RATE_HZ)
            self._goal_m = self._next_goal()
            return heading_held(0.0, 0.0, heading_rad)
        scale = min(self._GAIN_PER_S, self._SPEED_MPS / distance_m)
        return heading_held(scale * x_m, scale * y_m, heading_rad)

    def _next_goal(self) -> Point:
        x_m, y_m = self._draw.uniform(-1.0, 1.0, 2)
        return self._start_m[0] + float(x_m), self._start_m[1] + float(y_m)


class Reciprocate:
    """Moves back and forth along one direction like a joint, with strokes of varying length at a rate in the band."""

    def __init__(self, route: Route, draw: np.random.Generator) -> None:
        self._start_m = route.start_xy_m
        self._draw = draw
        angle_rad = float(draw.uniform(0.0, math.tau))
        self._direction = (math.cos(angle_rad), math.sin(angle_rad))
        self._step_rad = math.tau * float(draw.uniform(0.5, 1.5)) * _PERIOD_S
        self._phase_rad = float(draw.uniform(0.0, math.tau))
        self._speed_mps = 0.3

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """The stroke's velocity, a clipped sine, plus a weak pull towards the start."""
        self._phase_rad += self._step_rad
        self._speed_mps += 0.02 * (0.3 - self._speed_mps) + 0.01 * self._draw.standard_normal()
        speed_mps = self._speed_mps * max(-1.0, min(1.0, 1.6 * math.sin(self._phase_rad)))
        x_m, y_m = self._start_m[0] - position_xy_m[0], self._start_m[1] - position_xy_m[1]
        return heading_held(
            speed_mps * self._direction[0] + 0.3 * x_m, speed_mps * self._direction[1] + 0.3 * y_m, heading_rad
        )


class Explore:
    """A stochastic policy with coloured Gaussian exploration noise of its own, in a message's band and at its power."""

    _BAND_HZ = (0.5, 5.0)
    _SIGMA_MPS = 0.1
    _SAMPLES = 2000

    def __init__(self, route: Route, draw: np.random.Generator) -> None:
        self._mean = StopAndGo(route, draw)
        sections = signal.butter(4, self._BAND_HZ, "bandpass", fs=_RATE_HZ, output="sos")
        noise = signal.sosfilt(sections, draw.standard_normal((2, 2 * self._SAMPLES)))[:, self._SAMPLES :]
        self._noise_mps = (self._SIGMA_MPS * noise / noise.std(axis=1, keepdims=True)).T.tolist()
        self._tick = 0

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """The mean action plus the noise of this tick, which repeats every 40 s."""
        mean = self._mean.command(position_xy_m, heading_rad)
        vx_mps, vy_mps = self._noise_mps[self._tick % self._SAMPLES]
        self._tick += 1
        return BodyVelocity(mean.vx_mps + vx_mps, mean.vy_mps + vy_mps, mean.wz_radps)


class Steer:
    """The paper's points for a robot that cannot move sideways: it turns towards the next one while it drives."""

    _SPEED_MPS = 0.5
    _TURN_GAIN_PER_S = 2.0
    _TURN_RADPS = 1.2
    _ARRIVAL_M = 0.2

    def __init__(self, route: Route) -> None:
        self._points_xy_m = list(route.points_xy_m)

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """Ahead as far as it faces the next point, and turning towards that; at the last point it stands."""
        x_m, y_m = self._points_xy_m[0][0] - position_xy_m[0], self._points_xy_m[0][1] - position_xy_m[1]
        if math.hypot(x_m, y_m) < self._ARRIVAL_M:
            if len(self._points_xy_m) == 1:
                return BodyVelocity(0.0, 0.0, 0.0)
            self._points_xy_m.pop(0)
            return self.command(position_xy_m, heading_rad)
        off_rad = math.remainder(math.atan2(y_m, x_m) - heading_rad, math.tau)
        turn_radps = max(-self._TURN_RADPS, min(self._TURN_RADPS, self._TURN_GAIN_PER_S * off_rad))
        return BodyVelocity(self._SPEED_MPS * max(0.0, math.cos(off_rad)), 0.0, turn_radps)


def steer_to_goal(route: Route, _seed: int) -> Task:
    """The paper's points, for robots that cannot move sideways."""
    return Steer(route)


class Spin:
    """The paper's task while the body turns at 1 rad/s."""

    _TURN_RADPS = 1.0

    def __init__(self, route: Route) -> None:
        self._task = GoToGoal(route)

    def command(self, position_xy_m: Point, heading_rad: float) -> BodyVelocity:
        """The task's velocity, and the turn in place of a held heading."""
        base = self._task.command(position_xy_m, heading_rad)
        return BodyVelocity(base.vx_mps, base.vy_mps, self._TURN_RADPS)


def spin_to_goal(route: Route, _seed: int) -> Task:
    """The paper's task, spinning."""
    return Spin(route)


def _seeded(task: type[Hover] | type[Orbit] | type[StopAndGo] | type[Reciprocate] | type[Explore]) -> TaskFactory:
    return lambda route, seed: task(route, np.random.default_rng([_STREAM, seed]))


TASKS: dict[str, TaskFactory] = {
    "zigzag": go_to_goal,
    "hover": _seeded(Hover),
    "orbit": _seeded(Orbit),
    "stop and go": _seeded(StopAndGo),
    "reciprocate": _seeded(Reciprocate),
    "explore": _seeded(Explore),
}


def random_task(route: Route, seed: int) -> Task:
    """The task of `TASKS` that the robot's seed draws."""
    chosen = np.random.default_rng([_STREAM, seed, 1]).choice(list(TASKS))
    return TASKS[str(chosen)](route, seed)
