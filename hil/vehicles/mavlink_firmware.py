"""How three autopilots treat set-points, as their public sources and manuals have it; independent of the transport.

- ArduPilot Copter and Rover, manuals "Copter/Rover Commands in Guided Mode" and the sources behind them: which frames
  and masks are obeyed, and that a vehicle stops when no set-point came for GUID_TIMEOUT, 3 s by default.
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
_FORCE, _YAW, _YAW_RATE = 1 << 9, 1 << 10, 1 << 11


@dataclass(frozen=True, kw_only=True)
class Firmware:
    """One autopilot.

    `guided_mode` and `other_mode` are custom modes as heartbeats have them. `velocity_bits` are those mask bits of
    which none may be set. Without a set-point for `loss_s` the vehicle stops, and when `leaves_on_loss` it leaves
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

    def custom_mode(self, main: float, sub: float) -> int:
        """The custom mode that the two parameters of MAV_CMD_DO_SET_MODE ask for."""
        return int(main) << 16 | int(sub) << 24 if self.leaves_on_loss else int(main)

    def velocity(self, setpoint: Any, heading_rad: float) -> BodyVelocity | None:
        """What a SET_POSITION_TARGET_LOCAL_NED demands, in REP-103; None for one that is not obeyed as a velocity."""
        mask, frame = setpoint.type_mask, setpoint.coordinate_frame
        ahead, right, turn = setpoint.vx, setpoint.vy, setpoint.yaw_rate
        if frame not in self.frames or not all(map(math.isfinite, (ahead, right, setpoint.vz, turn))):
            return None
        ignores_too_much = mask & (self.velocity_bits | _YAW_RATE)
        ignores_enough = not ~mask & (_POSITION | _ACCELERATION | _YAW)
        if ignores_too_much or not ignores_enough or mask & _FORCE:
            return None
        if self.is_holonomic and setpoint.vz != 0.0:
            return None  # nothing here climbs
        if not self.is_holonomic:
            # Rover makes its speed of the vector's length, and takes backwards from the first component's sign.
            return BodyVelocity(math.copysign(math.hypot(ahead, right), ahead), 0.0, 0.0 - turn)
        if frame in (LOCAL_NED, LOCAL_OFFSET_NED):
            cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
            ahead, right = cosine * ahead - sine * right, sine * ahead + cosine * right
        return BodyVelocity(ahead, 0.0 - right, 0.0 - turn)


_ALL_FRAMES = frozenset({LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED})

COPTER: Final = Firmware(
    autopilot=3, vehicle_type=2, guided_mode=4, other_mode=5, frames=_ALL_FRAMES, velocity_bits=_VELOCITY_XYZ,
    is_holonomic=True, loss_s=3.0,
)  # fmt: skip
ROVER: Final = Firmware(
    autopilot=3, vehicle_type=10, guided_mode=15, other_mode=4, frames=_ALL_FRAMES, velocity_bits=_VELOCITY_XY,
    is_holonomic=False, loss_s=3.0,
)  # fmt: skip
PX4: Final = Firmware(
    autopilot=12, vehicle_type=2, guided_mode=6 << 16, other_mode=4 << 16 | 3 << 24,
    frames=frozenset({LOCAL_NED, BODY_NED}), velocity_bits=_VELOCITY_XYZ, is_holonomic=True, loss_s=1.0,
    leaves_on_loss=True, stream_s=1.0, stream_gap_s=0.5,
)  # fmt: skip
