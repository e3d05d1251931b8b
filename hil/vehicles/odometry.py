"""A robot's odometry: its pose relative to where it was switched on."""

import math

from hil.vehicles.motion_controller import Plant


class Odometry:
    """The pose of `plant` relative to its pose now, without error, in REP-103 signs."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._start_xy_m = plant.position_xy_m
        self._start_heading_rad = plant.heading_rad

    @property
    def position_xy_m(self) -> tuple[float, float]:
        """Position from the start, in the frame of the start."""
        x_m, y_m = self._plant.position_xy_m
        start_x_m, start_y_m = self._start_xy_m
        return turned(x_m - start_x_m, y_m - start_y_m, -self._start_heading_rad)

    @property
    def heading_rad(self) -> float:
        """Heading from that at the start, -pi to pi, counter-clockwise."""
        return math.remainder(self._plant.heading_rad - self._start_heading_rad, math.tau)


def turned(x: float, y: float, angle_rad: float) -> tuple[float, float]:
    """The vector turned counter-clockwise."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    return cosine * x - sine * y, sine * x + cosine * y
