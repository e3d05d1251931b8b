"""What the RoboMaster's messages say: payloads built and read, and DJI's signs turned into REP-103.

DJI counts y to the right, yaw clockwise and turn rates in degrees a second; everything else in this project is
REP-103. `_dji` and `_rep103` are the one place where the two meet. Velocities travel as 32-bit floats and are never
rounded further (DJI's own client rounds to 0.01 m/s and 1 deg/s, which would erase the noise). Layouts follow DJI's
open SDK and captures of a real robot's bus.
"""

import math
import struct

from mtm_onboard.motion import BodyVelocity

_SPEED = struct.Struct("<fff")


def speed_payload(velocity: BodyVelocity) -> bytes:
    """Payload of a speed command: forward and rightward m/s, clockwise deg/s.

    Raises ValueError for values that are not finite or do not fit a 32-bit float.
    """
    if not velocity.is_finite():
        raise ValueError(f"the command {tuple(velocity)} is not finite; send finite speeds only")
    try:
        # 0.0 - v instead of -v, so that standing still has no negative zeros, as on the real bus.
        return _SPEED.pack(velocity[0], 0.0 - velocity[1], 0.0 - math.degrees(velocity[2]))
    except OverflowError:
        raise ValueError(f"the command {tuple(velocity)} does not fit 32-bit floats; send sane speeds only") from None


def speed_velocity(payload: bytes) -> BodyVelocity:
    """The velocity of a speed command's payload; NaN and infinity are passed on for the caller to judge."""
    forward_mps, rightward_mps, clockwise_degps = _SPEED.unpack(payload)
    return BodyVelocity(forward_mps, 0.0 - rightward_mps, 0.0 - math.radians(clockwise_degps))
