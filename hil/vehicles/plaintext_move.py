"""`chassis move` of a RoboMaster EP: a way and a turn of a stated length, then a standstill."""

import math
from dataclasses import dataclass
from typing import Final

from hil.vehicles.plaintext_grammar import FAILED, RefusalError
from mtm_onboard.links.plaintext_messages import MOST_DEGPS, MOST_MPS
from mtm_onboard.links.robomaster_messages import counter_clockwise_rad, flipped
from mtm_onboard.model.velocity import STOP, BodyVelocity

MOVE_KEYS: Final = ("x", "y", "z", "vxy", "vz")

_MOST_M, _MOST_DEG = 5.0, 1800.0
_USUAL_MPS, _USUAL_DEGPS = 0.5, 30.0


@dataclass(frozen=True)
class Move:
    """A straight way in the frame where it began, and a turn beside it, each at a constant speed from `since_s` on."""

    since_s: float
    vx_mps: float
    vy_mps: float
    wz_radps: float
    way_s: float
    turn_s: float

    def velocity(self, now_s: float) -> BodyVelocity:
        """What the chassis has to do now, in its own frame; a standstill once it is over."""
        elapsed_s = now_s - self.since_s
        if self.is_over(now_s):
            return STOP
        turned_rad = self.wz_radps * min(elapsed_s, self.turn_s)
        cosine, sine = math.cos(turned_rad), math.sin(turned_rad)
        x, y = (self.vx_mps, self.vy_mps) if elapsed_s < self.way_s else (0.0, 0.0)
        turn_radps = self.wz_radps if elapsed_s < self.turn_s else 0.0
        return BodyVelocity(cosine * x + sine * y, cosine * y - sine * x, turn_radps)

    def is_over(self, now_s: float) -> bool:
        """Whether both are done."""
        return now_s - self.since_s >= max(self.way_s, self.turn_s)


def move(wanted: dict[str, float], now_s: float) -> Move:
    """The move that begins now; raises RefusalError for one beyond what the robot takes.

    No source says whether the angle of a move counts the other way than the turn rate of a speed, as it does in the
    binary protocol; here both are clockwise.
    """
    x_m, y_m, angle_deg = (wanted.get(key, 0.0) for key in ("x", "y", "z"))
    speed_mps, speed_degps = wanted.get("vxy", _USUAL_MPS), wanted.get("vz", _USUAL_DEGPS)
    # Written so that what is not a number fails as well.
    if not (abs(x_m) <= _MOST_M and abs(y_m) <= _MOST_M and abs(angle_deg) <= _MOST_DEG):
        raise RefusalError(FAILED)
    if not (0.0 < speed_mps <= MOST_MPS and 0.0 < speed_degps <= MOST_DEGPS):
        raise RefusalError(FAILED)
    way_s, turn_s = math.hypot(x_m, y_m) / speed_mps, abs(angle_deg) / speed_degps
    vx_mps, vy_mps = (x_m / way_s, flipped(y_m / way_s)) if way_s else (0.0, 0.0)
    wz_radps = counter_clockwise_rad(math.copysign(speed_degps, angle_deg)) if turn_s else 0.0
    return Move(now_s, vx_mps, vy_mps, wz_radps, way_s, turn_s)
