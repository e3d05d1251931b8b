"""Between body velocities in REP-103 signs and MAVLink's messages, which look ahead, to the right and down.

Ahead, left and counter-clockwise are positive here; MAVLink has y to the right and turns clockwise, so that these
two change their signs. Headings count counter-clockwise from north here, and positions are north and west.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

from mtm_onboard.links.mavlink_profiles import BODY_NED, Profile
from mtm_onboard.model.velocity import BodyVelocity

AUTOPILOT_COMPONENT: Final = 1  # MAV_COMP_ID_AUTOPILOT1
COMPANION_COMPONENT: Final = 191  # MAV_COMP_ID_ONBOARD_COMPUTER

DO_SET_MODE: Final = 176  # MAV_CMD
ARM_DISARM: Final = 400  # MAV_CMD_COMPONENT_ARM_DISARM
CUSTOM_MODE_FLAG: Final = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
ARMED_FLAG: Final = 128  # MAV_MODE_FLAG_SAFETY_ARMED

_ONBOARD_CONTROLLER = 18  # MAV_TYPE
_NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID
_ACTIVE = 4  # MAV_STATE
_MOST_SINGLE = 3.4028234e38
_BOOT_MS_WRAP = 1 << 32


@dataclass(frozen=True, kw_only=True)
class VehicleTelemetry:
    """The vehicle's own estimate in REP-103 signs, from its newest attitude and position.

    `robot_time_s` is the vehicle's clock at the position, `received_s` ours on reading it. Velocities are in m/s, in
    the body's frame and along (north, west); positions are metres (north, west) of the estimator's origin.
    """

    robot_time_s: float
    received_s: float
    velocity_body_mps: tuple[float, float]
    velocity_world_mps: tuple[float, float]
    position_xy_m: tuple[float, float]
    heading_rad: float
    turn_rate_radps: float


def companion_heartbeat(messages: Any) -> Any:
    """What a companion computer says once a second; `messages` is pymavlink's dialect."""
    return messages.MAVLink_heartbeat_message(_ONBOARD_CONTROLLER, _NO_AUTOPILOT, 0, 0, _ACTIVE, 3)


def velocity_setpoint(messages: Any, profile: Profile, target_system: int, velocity: BodyVelocity, now_s: float) -> Any:
    """SET_POSITION_TARGET_LOCAL_NED with velocity and turn rate in the body's frame, all else ignored.

    Raises ValueError for values that are not finite in 32 bits, and for a sideways speed that the vehicle cannot have:
    dropping it would drop a part of the message that the motion carries.
    """
    if not all(abs(value) <= _MOST_SINGLE for value in velocity):
        raise ValueError(f"the command {tuple(velocity)} is not finite in 32 bits; send speeds a vehicle can have")
    if velocity.vy_mps != 0.0 and not profile.is_holonomic:
        raise ValueError(
            f"A {profile.name} cannot move sideways, and {velocity.vy_mps:g} m/s to the left were asked for; give its "
            "channel the axes vx and wz, and send base commands without vy."
        )
    return messages.MAVLink_set_position_target_local_ned_message(
        int(1e3 * now_s) % _BOOT_MS_WRAP, target_system, AUTOPILOT_COMPONENT, BODY_NED, profile.type_mask,
        0.0, 0.0, 0.0, velocity.vx_mps, 0.0 - velocity.vy_mps, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0 - velocity.wz_radps,
    )  # fmt: skip


def mode_request(messages: Any, profile: Profile, target_system: int, attempt: int) -> Any:
    """COMMAND_LONG that asks for the profile's mode; `attempt` counts from 0."""
    main, sub = profile.mode_parameters
    return _command(messages, target_system, DO_SET_MODE, (CUSTOM_MODE_FLAG, main, sub), attempt)


def arm_request(messages: Any, target_system: int, attempt: int) -> Any:
    """COMMAND_LONG that asks to arm, with all of the vehicle's own checks."""
    return _command(messages, target_system, ARM_DISARM, (1.0, 0.0, 0.0), attempt)


def _command(
    messages: Any, target_system: int, command: int, parameters: tuple[float, float, float], attempt: int
) -> Any:
    return messages.MAVLink_command_long_message(
        target_system, AUTOPILOT_COMPONENT, command, attempt % 256, *parameters, 0.0, 0.0, 0.0, 0.0
    )


def telemetry(attitude: Any, position: Any, now_s: float) -> VehicleTelemetry:
    """From one ATTITUDE and one LOCAL_POSITION_NED; raises ValueError when a value in use is not finite."""
    north, east = position.vx, position.vy
    values = (attitude.yaw, attitude.yawspeed, position.x, position.y, north, east)
    if not all(map(math.isfinite, values)):
        raise ValueError("telemetry with values that are not finite")
    cosine, sine = math.cos(attitude.yaw), math.sin(attitude.yaw)
    ahead, right = cosine * north + sine * east, cosine * east - sine * north
    return VehicleTelemetry(
        robot_time_s=1e-3 * position.time_boot_ms,
        received_s=now_s,
        velocity_body_mps=(ahead, 0.0 - right),
        velocity_world_mps=(north, 0.0 - east),
        position_xy_m=(position.x, 0.0 - position.y),
        heading_rad=0.0 - attitude.yaw,
        turn_rate_radps=0.0 - attitude.yawspeed,
    )
