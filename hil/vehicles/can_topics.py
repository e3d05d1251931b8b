"""What a simulated RoboMaster pushes under each topic that clients are known to ask for, with DJI's axes and units.

Numbers, sizes and layouts as in the open CAN libraries; where nobody knows a layout, or the plant has no such thing,
the right number of zeros goes out, so that what comes after stands where its reader looks for it.
"""

import math
import struct
from collections.abc import Callable
from typing import Final

from hil.plants.mecanum import RIM_MPS_PER_RPM, wheel_rims_mps
from mtm_onboard.links.robomaster_messages import clockwise_deg
from mtm_onboard.links.robomaster_telemetry import TOPICS, Telemetry, topic_data
from mtm_onboard.model.velocity import STOP, BodyVelocity

ESC: Final = 0x00020003E226A309
IMU: Final = 0x00020003DC1C1DF4
BATTERY: Final = 0x00020003D7F5DCFB
GIMBAL_BASE: Final = 0x00020003882902A7
STATUS: Final = 0x000200030858C503

_ESC = struct.Struct("<4h4h4I4B")
_IMU = struct.Struct("<6f")
_BATTERY = struct.Struct("<HhiBB")
_STATUS = struct.Struct("<I")
_GIMBAL_BASE_BYTES = 14
_MOST_RPM = 32_767
_STANDS_STILL = 1
_MILLIVOLTS, _TENTHS_OF_A_DEGREE, _MILLIAMPERES, _PERCENT = 11_948, 221, -745, 84


def _esc(velocity: BodyVelocity) -> bytes:
    front_left, front_right, rear_left, rear_right = (
        max(-_MOST_RPM, min(_MOST_RPM, round(rim_mps / RIM_MPS_PER_RPM))) for rim_mps in wheel_rims_mps(velocity)
    )
    return _ESC.pack(front_right, -front_left, -rear_left, rear_right, *(0,) * 12)


def _imu(velocity: BodyVelocity) -> bytes:
    return _IMU.pack(0.0, 0.0, -1.0, 0.0, 0.0, math.radians(clockwise_deg(velocity.wz_radps)))


_DATA: Final[dict[int, Callable[[BodyVelocity], bytes]]] = {
    ESC: _esc,
    IMU: _imu,
    BATTERY: lambda _: _BATTERY.pack(_MILLIVOLTS, _TENTHS_OF_A_DEGREE, _MILLIAMPERES, _PERCENT, 0),
    GIMBAL_BASE: lambda _: bytes(_GIMBAL_BASE_BYTES),
    STATUS: lambda velocity: _STATUS.pack(_STANDS_STILL if velocity == STOP else 0),
}

KNOWN_TOPICS: Final = TOPICS | _DATA.keys()


def pushed_data(topic: int, telemetry: Telemetry, velocity: BodyVelocity) -> bytes:
    """The bytes of one topic; none for a topic that is not known, whose size nobody could tell."""
    if topic in TOPICS:
        return topic_data(topic, telemetry)
    return _DATA[topic](velocity) if topic in _DATA else b""
