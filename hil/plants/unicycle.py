"""A vehicle that drives ahead and turns but cannot move sideways, such as a skid-steered rover."""

import math

from mtm_onboard.model.velocity import STOP, BodyVelocity


class UnicyclePlant:
    """Speed and turn rate follow what is demanded with a first-order lag of `lag_s`, at once when it is zero.

    A sideways demand has no effect. Between calls of `step` the pose stays; a step takes the mean speeds over it.
    """

    def __init__(
        self, lag_s: float = 0.0, position_xy_m: tuple[float, float] = (0.0, 0.0), heading_rad: float = 0.0
    ) -> None:
        self._lag_s = lag_s
        self._x_m, self._y_m = position_xy_m
        self._heading_rad = heading_rad
        self._now_s = 0.0
        self._demand = STOP
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
        """True body velocity."""
        return self._velocity

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        """Demand a body velocity."""
        self._demand = BodyVelocity(velocity.vx_mps, 0.0, velocity.wz_radps)
        if self._lag_s == 0.0:
            self._velocity = self._demand

    def step(self, now_s: float) -> None:
        """Advance to `now_s`."""
        elapsed_s = now_s - self._now_s
        self._now_s = now_s
        if elapsed_s <= 0.0:
            return
        before = self._velocity
        if self._lag_s > 0.0:
            keep = math.exp(-elapsed_s / self._lag_s)
            self._velocity = BodyVelocity(*(d + keep * (v - d) for d, v in zip(self._demand, before, strict=True)))
            mean = self._lag_s * (1.0 - keep) / elapsed_s
            before = BodyVelocity(*(d + mean * (v - d) for d, v in zip(self._demand, before, strict=True)))
        turn_rad = elapsed_s * before.wz_radps
        middle_rad = self._heading_rad + 0.5 * turn_rad
        self._x_m += elapsed_s * before.vx_mps * math.cos(middle_rad)
        self._y_m += elapsed_s * before.vx_mps * math.sin(middle_rad)
        self._heading_rad += turn_rad
