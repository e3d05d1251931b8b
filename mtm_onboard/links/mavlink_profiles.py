"""What differs between the autopilots that a MAVLink link can drive: modes, masks and what must come before them.

Facts are from the public documentation: ArduPilot's "Copter Commands in Guided Mode" and "Rover Commands in Guided
Mode", PX4's "Offboard Mode", and MAVLink's common message set.
"""

from dataclasses import dataclass
from typing import Final

from mtm_onboard.protocol.errors import MtmError

BODY_NED: Final = 8  # velocities ahead, to the right and down of the vehicle; all three profiles take it

# Bits of POSITION_TARGET_TYPEMASK: a set bit has its field ignored.
IGNORE_POSITION: Final = 0b111 << 0
IGNORE_VELOCITY: Final = 0b111 << 3
IGNORE_DOWN_VELOCITY: Final = 1 << 5
IGNORE_ACCELERATION: Final = 0b111 << 6
IS_FORCE: Final = 1 << 9
IGNORE_YAW: Final = 1 << 10
IGNORE_YAW_RATE: Final = 1 << 11

_VELOCITY_AND_YAW_RATE = IGNORE_POSITION | IGNORE_ACCELERATION | IGNORE_YAW

_ARDUPILOT = 3  # MAV_AUTOPILOT_ARDUPILOTMEGA
_PX4 = 12  # MAV_AUTOPILOT_PX4
_MULTIROTORS = frozenset({2, 3, 4, 13, 14, 15, 29, 35})  # MAV_TYPE: quadrotor, coaxial, helicopter, hexa- to decarotor
_GROUND_VEHICLES = frozenset({10, 11})  # MAV_TYPE: ground rover, surface boat


@dataclass(frozen=True, kw_only=True)
class Profile:
    """One kind of vehicle.

    `mode` obeys set-points and is `custom_mode` in heartbeats; `mode_parameters` ask for it in MAV_CMD_DO_SET_MODE.
    `type_mask` is that of a set-point. A vehicle that is not `is_holonomic` cannot move sideways. `stream_s` is how
    long set-points must have come before the vehicle lets itself be put into `mode`, None when they need not.
    """

    name: str
    autopilot: int
    vehicle_types: frozenset[int]
    mode: str
    custom_mode: int
    mode_parameters: tuple[float, float]
    type_mask: int
    is_holonomic: bool
    stream_s: float | None = None


# Rover takes speed ahead and turn rate; it makes the speed from the length of (vx, vy), so vy must stay zero.
_ROVER = Profile(
    name="rover", autopilot=_ARDUPILOT, vehicle_types=_GROUND_VEHICLES, mode="GUIDED", custom_mode=15,
    mode_parameters=(15.0, 0.0), type_mask=_VELOCITY_AND_YAW_RATE | IGNORE_DOWN_VELOCITY, is_holonomic=False,
)  # fmt: skip

# Copter counts the whole velocity as ignored when one of its three bits is set; down stays zero, which holds height.
_COPTER = Profile(
    name="copter", autopilot=_ARDUPILOT, vehicle_types=_MULTIROTORS, mode="GUIDED", custom_mode=4,
    mode_parameters=(4.0, 0.0), type_mask=_VELOCITY_AND_YAW_RATE, is_holonomic=True,
)  # fmt: skip

# PX4 keeps its main mode in the third byte of the custom mode; OFFBOARD is number 6. It has to have received
# set-points, at more than 2 Hz, for more than a second.
_PX4_COPTER = Profile(
    name="px4", autopilot=_PX4, vehicle_types=_MULTIROTORS, mode="OFFBOARD", custom_mode=6 << 16,
    mode_parameters=(6.0, 0.0), type_mask=_VELOCITY_AND_YAW_RATE, is_holonomic=True, stream_s=1.2,
)  # fmt: skip

PROFILES: Final = {profile.name: profile for profile in (_ROVER, _COPTER, _PX4_COPTER)}


def profile_named(name: str) -> Profile:
    """The profile of this name; raises MtmError when there is none."""
    if name not in PROFILES:
        raise MtmError(f"the MAVLink profile is {name!r}; choose one of: {', '.join(PROFILES)}")
    return PROFILES[name]
