"""Robots of the family: how one follows, what disturbs it, and its motion, over a whole run or step by step."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hil.plants.interference import Interference
from hil.plants.responses import Floats, Response
from mtm_onboard.model.velocity import STOP, BodyVelocity

STEP_S = 0.01
_BLOCK = 500


@dataclass(frozen=True)
class Robot:
    """One robot: `respond` makes its response at rest and `disturb` its interference, both for that step length.

    Demand, what is followed and interference are body velocities (n, 3): vx, vy in m/s, wz in rad/s.
    """

    respond: Callable[[float], Response]
    disturb: Callable[[float, np.random.Generator], Interference]


def path(velocities_body: Floats, step_s: float) -> Floats:
    """Poses (n, 3) in the world frame after each step: x, y in m, heading in rad; all are zero before the first.

    The midpoint heading makes a step exact to second order in the turn.
    """
    headings = np.cumsum(velocities_body[:, 2]) * step_s
    middle = headings - 0.5 * step_s * velocities_body[:, 2]
    cosine, sine = np.cos(middle), np.sin(middle)
    ahead, left = velocities_body[:, 0], velocities_body[:, 1]
    world = np.stack([cosine * ahead - sine * left, sine * ahead + cosine * left], axis=1)
    return np.column_stack([np.cumsum(world, axis=0) * step_s, headings])


def driven(robot: Robot, demand: Floats, draw: np.random.Generator, step_s: float = STEP_S) -> Floats:
    """Poses (n, 3) of the robot after each step of the demand, with its interference."""
    followed = robot.respond(step_s).advance(demand)
    return path(followed + robot.disturb(step_s, draw).advance(len(demand)), step_s)


class SteppedRobot:
    """The robot under a motion controller: `command` takes the newest demand, `step` advances in whole steps.

    The same seed gives the same interference whatever the commands are. Between steps the pose is that of the last one.
    """

    def __init__(
        self, robot: Robot, seed: int, position_xy_m: tuple[float, float] = (0.0, 0.0), heading_rad: float = 0.0
    ) -> None:
        self._response = robot.respond(STEP_S)
        self._interference = robot.disturb(STEP_S, np.random.default_rng(seed))
        self._noise: list[Floats] = []
        self._steps = 0
        self._demand = STOP
        self._velocity = STOP
        self._pose = np.array([*position_xy_m, heading_rad])

    @property
    def position_xy_m(self) -> tuple[float, float]:
        """Position in the world frame."""
        return float(self._pose[0]), float(self._pose[1])

    @property
    def heading_rad(self) -> float:
        """Heading, counter-clockwise from the world's x axis, not wrapped."""
        return float(self._pose[2])

    @property
    def velocity_body(self) -> BodyVelocity:
        """True body velocity of the last step."""
        return self._velocity

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        """Demand a body velocity from the next step on."""
        self._demand = velocity

    def step(self, now_s: float) -> None:
        """Advance in whole steps up to `now_s`."""
        # Half a microsecond of slack: instants are sums of decimal fractions.
        while (self._steps + 1) * STEP_S <= now_s + 5e-7:
            if not self._noise:
                self._noise = list(self._interference.advance(_BLOCK)[::-1])
            velocity = self._response.advance(np.array([self._demand]))[0] + self._noise.pop()
            moved = path(velocity[None, :], STEP_S)[0]
            cosine, sine = np.cos(self._pose[2]), np.sin(self._pose[2])
            self._pose += [cosine * moved[0] - sine * moved[1], sine * moved[0] + cosine * moved[1], moved[2]]
            self._velocity = BodyVelocity(*velocity.tolist())
            self._steps += 1
