"""Body velocities, in the frame and signs of REP-103: x forward, y left, z counter-clockwise seen from above."""

import math
from typing import NamedTuple

AXES = ("vx", "vy", "wz")


class BodyVelocity(NamedTuple):
    """One command: forward and leftward speed in m/s, counter-clockwise turn rate in rad/s."""

    vx_mps: float
    vy_mps: float
    wz_radps: float

    def is_finite(self) -> bool:
        """False when any component is NaN or infinite."""
        return math.isfinite(self.vx_mps) and math.isfinite(self.vy_mps) and math.isfinite(self.wz_radps)


STOP = BodyVelocity(0.0, 0.0, 0.0)
