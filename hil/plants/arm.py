"""An arm of two links in the plane: the demanded velocity of its tool goes through joints with gear play."""

import numpy as np

from hil.plants.responses import Backlash, Chain, Floats, Response, lag

UPPER_M, FORE_M = 0.5, 0.4
# Where the tool is at rest, a comfortable bend of the elbow: it works within half a metre of it.
_HOME_RAD = np.array([-0.6, 1.5])


class Arm:
    """Tool velocities to tool velocities; the joints follow with a lag and `play_rad` of backlash each.

    The controller knows where its motors are and not where the links are, as encoders on the motors' side tell it.
    """

    def __init__(self, step_s: float, lag_s: float, play_rad: float) -> None:
        self._step_s = step_s
        self._joints: Response = Chain(lag(step_s, lag_s), Backlash(step_s, play_rad))
        self._commanded_rad = _HOME_RAD.copy()
        self._links_rad = _HOME_RAD.copy()

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demanded tool velocities (n, 3) of the next steps; a turn is not followed."""
        result = np.zeros_like(demand)
        for row, tool in enumerate(demand[:, :2]):
            speeds = np.linalg.solve(_jacobian(self._commanded_rad), tool)
            self._commanded_rad += speeds * self._step_s
            before = _tool(self._links_rad)
            self._links_rad += self._joints.advance(speeds[None, :])[0] * self._step_s
            result[row, :2] = (_tool(self._links_rad) - before) / self._step_s
        return result


def _tool(joints_rad: Floats) -> Floats:
    shoulder, both = joints_rad[0], joints_rad.sum()
    return np.array(
        [UPPER_M * np.cos(shoulder) + FORE_M * np.cos(both), UPPER_M * np.sin(shoulder) + FORE_M * np.sin(both)]
    )


def _jacobian(joints_rad: Floats) -> Floats:
    x, y = _tool(joints_rad)
    both = joints_rad.sum()
    return np.array([[-y, -FORE_M * np.sin(both)], [x, FORE_M * np.cos(both)]])
