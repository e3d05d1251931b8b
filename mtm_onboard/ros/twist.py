"""Body velocities and geometry_msgs/Twist, which have the same frame and signs: both follow REP-103."""

from typing import Any

from mtm_onboard.model.velocity import BodyVelocity


def velocity_of(twist: Any) -> BodyVelocity:
    """A twist's motion in the plane in m/s and rad/s, finite or not; its other three components are left out."""
    return BodyVelocity(float(twist.linear.x), float(twist.linear.y), float(twist.angular.z))


def set_velocity(twist: Any, velocity: BodyVelocity) -> None:
    """Make a new twist, whose components are zero, that motion."""
    twist.linear.x, twist.linear.y, twist.angular.z = velocity
