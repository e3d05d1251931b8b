"""A plant for tests: it takes every demanded velocity at once and integrates it exactly."""

import math

from mtm_onboard.model.velocity import STOP, BodyVelocity


class FloatingPlant:
    def __init__(self) -> None:
        self.commands: list[tuple[float, BodyVelocity]] = []
        self._now_s = 0.0
        self._x_m = 0.0
        self._y_m = 0.0
        self._heading_rad = 0.0
        self._velocity = STOP

    @property
    def position_xy_m(self) -> tuple[float, float]:
        return self._x_m, self._y_m

    @property
    def heading_rad(self) -> float:
        return self._heading_rad

    @property
    def velocity_body(self) -> BodyVelocity:
        return self._velocity

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        self.commands.append((now_s, velocity))
        self._velocity = velocity

    def step(self, now_s: float) -> None:
        elapsed_s = now_s - self._now_s
        cosine, sine = math.cos(self._heading_rad), math.sin(self._heading_rad)
        self._x_m += elapsed_s * (cosine * self._velocity.vx_mps - sine * self._velocity.vy_mps)
        self._y_m += elapsed_s * (sine * self._velocity.vx_mps + cosine * self._velocity.vy_mps)
        self._heading_rad += elapsed_s * self._velocity.wz_radps
        self._now_s = now_s
