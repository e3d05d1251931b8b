"""How three autopilots treat set-points, as their public sources and manuals have it; independent of the transport.

- ArduPilot Copter and Rover, manuals "Copter/Rover Commands in Guided Mode" and the sources behind them: which frames
  and masks are obeyed, and that a vehicle stops when no set-point came for GUID_TIMEOUT, 3 s by default. The mask's
  force bit counts only where accelerations are not ignored; clients are known to set it.
- PX4, manual "Offboard Mode" and its parameter reference: frames, that set-points must have come at more than 2 Hz
  for more than a second before OFFBOARD can be entered, and that OFFBOARD is left after COM_OF_LOSS_T, 1 s by default
  in its present releases.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

from mtm_onboard.model.velocity import BodyVelocity

# MAV_FRAME: local north-east-down, the same from where the vehicle is, the body's own two.
LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED = 1, 7, 8, 9

_POSITION, _ACCELERATION = 0b111, 0b111 << 6
_VELOCITY_XY, _VELOCITY_XYZ = 0b011 << 3, 0b111 << 3
_VELOCITY_Z = 1 << 5
_FORCE, _YAW, _YAW_RATE = 1 << 9, 1 << 10, 1 << 11
# How a Rover that is told no yaw rate steers towards the velocity: ATC_STR_ANG_P, and half of ATC_STR_RAT_MAX.
_STEERING_PER_S, _MOST_STEERING_RADPS = 2.0, math.radians(60.0)


@dataclass(frozen=True, kw_only=True)
class Firmware:
    """One autopilot.

    `guided_mode` and `other_mode` are custom modes as heartbeats have them. `velocity_bits` are those mask bits of
    which none may be set, and `refuses_force` whether the force bit is one of them. `parameters` are some that clients
    ask for, by name. Without a set-point for `loss_s` the vehicle stops, and when `leaves_on_loss` it leaves
    the mode as well. `stream_s` is how long set-points must have come, less than `stream_gap_s` apart, before the
    mode can be entered.
    """

    autopilot: int
    vehicle_type: int
    guided_mode: int
    other_mode: int
    frames: frozenset[int]
    velocity_bits: int
    is_holonomic: bool
    loss_s: float
    leaves_on_loss: bool = False
    stream_s: float = 0.0
    stream_gap_s: float = math.inf
    refuses_force: bool = False
    parameters: tuple[tuple[str, float], ...] = ()

    def custom_mode(self, main: float, sub: float) -> int:
        """The custom mode that the two parameters of MAV_CMD_DO_SET_MODE ask for."""
        if not self.leaves_on_loss:
            return int(main)
        return int(main) << 16 | (int(sub) if math.isfinite(sub) else 0) << 24

    def velocity(self, setpoint: Any, heading_rad: float) -> BodyVelocity | None:
        """What a SET_POSITION_TARGET_LOCAL_NED demands, in REP-103; None for one that is not obeyed as a velocity."""
        mask, frame = setpoint.type_mask, setpoint.coordinate_frame
        # What the mask ignores may hold anything.
        ahead, right = setpoint.vx, setpoint.vy
        climb = 0.0 if mask & _VELOCITY_Z else setpoint.vz
        turn = 0.0 if mask & _YAW_RATE else setpoint.yaw_rate
        if frame not in self.frames or not all(map(math.isfinite, (ahead, right, climb, turn))):
            return None
        ignores_enough = not ~mask & (_POSITION | _ACCELERATION | _YAW)
        if mask & self.velocity_bits or not ignores_enough or (self.refuses_force and mask & _FORCE):
            return None
        if self.is_holonomic and climb != 0.0:
            return None  # nothing here climbs
        if not self.is_holonomic:
            if mask & _YAW_RATE:
                return _steered(ahead, right, frame, heading_rad)
            # Rover makes its speed of the vector's length, and takes backwards from the first component's sign.
            return BodyVelocity(math.copysign(math.hypot(ahead, right), ahead), 0.0, 0.0 - turn)
        if frame in (LOCAL_NED, LOCAL_OFFSET_NED):
            cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
            ahead, right = cosine * ahead - sine * right, sine * ahead + cosine * right
        return BodyVelocity(ahead, 0.0 - right, 0.0 - turn)


def _steered(forward: float, rightward: float, frame: int, heading_rad: float) -> BodyVelocity:
    """A Rover that is told a velocity alone turns to where it points, and drives with its length."""
    counter_clockwise_rad = math.atan2(-rightward, forward)
    if frame in (LOCAL_NED, LOCAL_OFFSET_NED):
        counter_clockwise_rad = math.remainder(counter_clockwise_rad - heading_rad, math.tau)
    turn_radps = max(-_MOST_STEERING_RADPS, min(_MOST_STEERING_RADPS, _STEERING_PER_S * counter_clockwise_rad))
    return BodyVelocity(math.hypot(forward, rightward), 0.0, turn_radps)


_ALL_FRAMES = frozenset({LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED})

COPTER: Final = Firmware(
    autopilot=3, vehicle_type=2, guided_mode=4, other_mode=5, frames=_ALL_FRAMES, velocity_bits=_VELOCITY_XYZ,
    is_holonomic=True, loss_s=3.0, parameters=(("SYSID_THISMAV", 1.0), ("ARMING_CHECK", 1.0), ("GUID_TIMEOUT", 3.0)),
)  # fmt: skip
ROVER: Final = Firmware(
    autopilot=3, vehicle_type=10, guided_mode=15, other_mode=4, frames=_ALL_FRAMES, velocity_bits=_VELOCITY_XY,
    is_holonomic=False, loss_s=3.0, parameters=(("SYSID_THISMAV", 1.0), ("ARMING_CHECK", 1.0), ("CRUISE_SPEED", 2.0)),
)  # fmt: skip
PX4: Final = Firmware(
    autopilot=12, vehicle_type=2, guided_mode=6 << 16, other_mode=4 << 16 | 3 << 24,
    frames=frozenset({LOCAL_NED, BODY_NED}), velocity_bits=_VELOCITY_XYZ, is_holonomic=True, loss_s=1.0,
    leaves_on_loss=True, stream_s=1.0, stream_gap_s=0.5, refuses_force=True,
    parameters=(("MAV_SYS_ID", 1.0), ("COM_OF_LOSS_T", 1.0)),
)  # fmt: skip
