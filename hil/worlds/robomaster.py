"""The paper's RoboMaster task: four robots drive a six-waypoint zigzag side by side, then each to its own target.

See the paper's Figure "robomaster-plots" and its appendix "Policy and Controller Details".

A proportional go-to-goal controller at the control rate gives each robot its base velocity, capped at the base
speed; heading is held at zero. Positions are in the world frame, metres, origin at the arena's centre.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Channel, Scheme
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.framing import PayloadKind

ROBOTS = 4
BASE_SPEED_MPS = 0.5

_GAIN_PER_S = 1.5
HEADING_GAIN_PER_S = 2.0
_ARRIVAL_M = 0.15
_SPACING_M = 0.55
_SWEEP_M = 2.4
_FIRST_Y_M = -1.9
_RISE_M = 0.5
_TARGET_Y_M = 2.0
# More robots than a row holds stand in rows behind each other, as many as the arena holds.
_ROW_M = 0.45
MOST_ROBOTS = 12
# Of the scheme that keys are made for here: windows as in the key generator's preset, a third of the symbols parity.
_WINDOW_TICKS = 200
_SYMBOL_BITS = 4
_NUMBER_BITS, _TAG_BITS = 4, 24
_SYMBOLS_A_DATA_SYMBOL = 4.0 / 3.0


def fleet_scheme(message_ticks: int = 600) -> Scheme:
    """The paper's scheme for this world, the key generator's preset `paper-robomaster-fleet`: M = 4, sigma 0.1."""
    names = [f"robot{number}" for number in range(ROBOTS)]
    channels = tuple(Channel(name, name, ("vx", "vy"), 1, 0.1) for name in names)
    return Scheme(
        name="robomaster-fleet",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=4,
        message_ticks=message_ticks,
        channels=channels,
    )


def tagged_scheme(robots: int = ROBOTS, payload: PayloadKind = "integer", payload_bits: int = 8) -> Scheme:
    """A rolling scheme with a tag for so many robots; by default that of the key generator's preset."""
    data_symbols = math.ceil((payload_bits + _NUMBER_BITS + _TAG_BITS) / _SYMBOL_BITS)
    each = math.ceil(data_symbols * _SYMBOLS_A_DATA_SYMBOL / robots)
    names = [f"robot{number}" for number in range(robots)]
    return Scheme(
        name="robomaster-fleet",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=1 << _SYMBOL_BITS,
        message_ticks=_WINDOW_TICKS * each,
        channels=tuple(Channel(name, name, ("vx", "vy"), each, 0.1) for name in names),
        power="window",
        schedule="rolling",
        framing=Framing(
            payload, payload_bits, number_bits=_NUMBER_BITS, check="tag", check_bits=_TAG_BITS, code="reed-solomon",
            interleave=True,
        ),
    )  # fmt: skip


@dataclass(frozen=True)
class Route:
    """Where one robot starts and the points (n, 2) it visits in order; it stays at the last one."""

    start_xy_m: tuple[float, float]
    points_xy_m: tuple[tuple[float, float], ...]


class Task(Protocol):
    """The task controller of one robot."""

    def command(self, position_xy_m: tuple[float, float], heading_rad: float) -> BodyVelocity:
        """Base velocity in the body frame for the present pose; asked once a tick."""
        ...


# From a robot's route and a seed of its own.
TaskFactory = Callable[[Route, int], Task]


def go_to_goal(route: Route, _seed: int) -> Task:
    """The paper's task, in which nothing is random."""
    return GoToGoal(route)


def routes(permutation: tuple[int, ...]) -> tuple[Route, ...]:
    """One route a robot: the zigzag, then target number `permutation[robot]` on the top edge."""
    rows = math.ceil(len(permutation) / ROBOTS)
    return tuple(_route(robot, target, rows) for robot, target in enumerate(permutation))


def random_permutation(generator: np.random.Generator, robots: int = ROBOTS) -> tuple[int, ...]:
    """Which of the four targets of its row each robot drives to."""
    rows = math.ceil(robots / ROBOTS)
    targets = [int(target) for _ in range(rows) for target in generator.permutation(ROBOTS)]
    return tuple(targets[:robots])


def _route(robot: int, target: int, rows: int) -> Route:
    row, place = divmod(robot, ROBOTS)
    lane_m, first_y_m = (place - (ROBOTS - 1) / 2.0) * _SPACING_M, _FIRST_Y_M + _ROW_M * row
    sides = (1.0, -1.0) * 3
    zigzag = tuple((lane_m + side * _SWEEP_M / 2.0, first_y_m + _RISE_M * (leg + 1)) for leg, side in enumerate(sides))
    end = ((target - (ROBOTS - 1) / 2.0) * 1.2, _TARGET_Y_M - _ROW_M * (rows - 1 - row))
    return Route((lane_m, first_y_m), (*zigzag, end))


class GoToGoal:
    """The task controller of one robot."""

    def __init__(self, route: Route) -> None:
        self._points_xy_m = route.points_xy_m
        self._next = 0

    def command(self, position_xy_m: tuple[float, float], heading_rad: float) -> BodyVelocity:
        """Base velocity in the body frame for the present pose; moves on to the next point on arrival."""
        goal_x_m, goal_y_m = self._points_xy_m[self._next]
        x_m, y_m = goal_x_m - position_xy_m[0], goal_y_m - position_xy_m[1]
        distance_m = math.hypot(x_m, y_m)
        if distance_m < _ARRIVAL_M and self._next + 1 < len(self._points_xy_m):
            self._next += 1
            return self.command(position_xy_m, heading_rad)
        scale = min(_GAIN_PER_S, BASE_SPEED_MPS / distance_m) if distance_m > 0.0 else 0.0
        return heading_held(scale * x_m, scale * y_m, heading_rad)


def heading_held(vx_mps: float, vy_mps: float, heading_rad: float) -> BodyVelocity:
    """A velocity in the world frame as a command in the body frame that turns the heading back to zero."""
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    return BodyVelocity(
        cosine * vx_mps + sine * vy_mps,
        cosine * vy_mps - sine * vx_mps,
        -HEADING_GAIN_PER_S * math.remainder(heading_rad, math.tau),
    )
