"""A mecanum-wheeled chassis: command delay, wheel-speed quantisation, lag, slip.

The chassis follows its wheel speeds with a first-order lag after a pure delay; wheel slip adds a velocity noise of
known standard deviation and correlation time. Wheel radius and track are those of the RoboMaster's public robot
description; the slip is calibrated (see `hil.experiments.detectors.calibrate`) and stands in robomaster_plant.toml.
"""

import math
import tomllib
from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mtm_onboard.model.velocity import STOP, BodyVelocity

WHEEL_RADIUS_M = 0.05
HALF_TRACK_SUM_M = 0.2  # half the wheelbase plus half the track: rim speed per turn rate
RIM_MPS_PER_RPM = 2.0 * math.pi * WHEEL_RADIUS_M / 60.0
PLANT_FILE = Path(__file__).with_name("robomaster_plant.toml")

_BLOCK = 4096


@dataclass(frozen=True, kw_only=True)
class MecanumParameters:
    """What the calibration file holds: seconds, m/s, rad/s; slips are standard deviations."""

    delay_s: float
    lag_s: float
    slip_mps: float
    slip_correlation_s: float
    yaw_slip_radps: float
    wheel_step_rpm: float
    step_s: float


def calibrated_parameters(path: Path = PLANT_FILE) -> MecanumParameters:
    """The plant that reproduces the paper's RoboMaster table with the paper's own detector."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    return MecanumParameters(**table["plant"])


def wheel_rims_mps(velocity: BodyVelocity) -> tuple[float, float, float, float]:
    """Forward-positive rim speeds (front left, front right, rear left, rear right) of a REP-103 body velocity."""
    vx, vy, turn = velocity.vx_mps, velocity.vy_mps, HALF_TRACK_SUM_M * velocity.wz_radps
    return vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn


def body_velocity(rims_mps: tuple[float, float, float, float]) -> BodyVelocity:
    """The inverse of `wheel_rims_mps` (least squares over the four wheels)."""
    front_left, front_right, rear_left, rear_right = rims_mps
    return BodyVelocity(
        (front_left + front_right + rear_left + rear_right) / 4.0,
        (-front_left + front_right + rear_left - rear_right) / 4.0,
        (-front_left + front_right - rear_left + rear_right) / (4.0 * HALF_TRACK_SUM_M),
    )


class MecanumPlant:
    """One chassis. `command` takes the newest demanded body velocity, `step` advances the physics in fixed steps.

    The same seed gives the same slip whatever the commands are. Between steps the pose is that of the last step.
    """

    def __init__(
        self,
        parameters: MecanumParameters,
        seed: int,
        position_xy_m: tuple[float, float] = (0.0, 0.0),
        heading_rad: float = 0.0,
    ) -> None:
        self._parameters = parameters
        self._generator = np.random.default_rng(seed)
        self._lag_decay = math.exp(-parameters.step_s / parameters.lag_s)
        self._slip_decay = math.exp(-parameters.step_s / parameters.slip_correlation_s)
        kick = math.sqrt(1.0 - self._slip_decay**2)
        self._slip_kick_mps = kick * parameters.slip_mps
        self._yaw_kick_radps = kick * parameters.yaw_slip_radps
        self._draws: list[list[float]] = []
        self._steps = 0
        self._pending: deque[tuple[float, BodyVelocity]] = deque()
        self._target = STOP
        self._followed = [0.0, 0.0, 0.0]
        self._slip = [parameters.slip_mps * self._generator.normal(), parameters.slip_mps * self._generator.normal()]
        self._yaw_slip = parameters.yaw_slip_radps * self._generator.normal()
        self._x_m, self._y_m = position_xy_m
        self._heading_rad = heading_rad
        self._velocity = STOP

    @property
    def position_xy_m(self) -> tuple[float, float]:
        """Position in the world frame."""
        return self._x_m, self._y_m

    @property
    def heading_rad(self) -> float:
        """Heading, counter-clockwise from the world's x axis, not wrapped."""
        return self._heading_rad

    @property
    def velocity_body(self) -> BodyVelocity:
        """True body velocity, slip included, of the last step."""
        return self._velocity

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        """Demand a body velocity; it takes effect after the delay."""
        self._pending.append((now_s + self._parameters.delay_s, self._quantised(velocity)))

    def step(self, now_s: float) -> None:
        """Advance in whole steps up to `now_s`."""
        step_s = self._parameters.step_s
        # Half a microsecond of slack: instants are sums of decimal fractions.
        while (self._steps + 1) * step_s <= now_s + 5e-7:
            self._advance(self._steps * step_s)
            self._steps += 1

    def _quantised(self, velocity: BodyVelocity) -> BodyVelocity:
        grain_mps = self._parameters.wheel_step_rpm * RIM_MPS_PER_RPM
        if grain_mps == 0.0:
            return velocity
        one, two, three, four = wheel_rims_mps(velocity)
        return body_velocity(
            (
                round(one / grain_mps) * grain_mps,
                round(two / grain_mps) * grain_mps,
                round(three / grain_mps) * grain_mps,
                round(four / grain_mps) * grain_mps,
            )
        )

    def _advance(self, start_s: float) -> None:
        pending = self._pending
        while pending and pending[0][0] <= start_s + 5e-7:
            self._target = pending.popleft()[1]
        if not self._draws:
            self._draws = self._generator.standard_normal((_BLOCK, 3)).tolist()
        draw = self._draws.pop()
        keep, slip_keep = self._lag_decay, self._slip_decay
        followed, slip, target = self._followed, self._slip, self._target
        followed[0] = target[0] + keep * (followed[0] - target[0])
        followed[1] = target[1] + keep * (followed[1] - target[1])
        followed[2] = target[2] + keep * (followed[2] - target[2])
        slip[0] = slip_keep * slip[0] + self._slip_kick_mps * draw[0]
        slip[1] = slip_keep * slip[1] + self._slip_kick_mps * draw[1]
        self._yaw_slip = slip_keep * self._yaw_slip + self._yaw_kick_radps * draw[2]
        self._velocity = BodyVelocity(followed[0] + slip[0], followed[1] + slip[1], followed[2] + self._yaw_slip)
        self._move(self._velocity)

    def _move(self, velocity: BodyVelocity) -> None:
        step_s = self._parameters.step_s
        # The midpoint heading makes the step exact to second order in the turn.
        middle_rad = self._heading_rad + 0.5 * step_s * velocity.wz_radps
        cosine, sine = math.cos(middle_rad), math.sin(middle_rad)
        self._x_m += step_s * (cosine * velocity.vx_mps - sine * velocity.vy_mps)
        self._y_m += step_s * (sine * velocity.vx_mps + cosine * velocity.vy_mps)
        self._heading_rad += step_s * velocity.wz_radps
