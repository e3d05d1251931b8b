"""Messages with the components of geometry_msgs/Twist."""

from dataclasses import dataclass, field


@dataclass
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Twist:
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)

    def six(self) -> tuple[float, ...]:
        return (
            self.linear.x, self.linear.y, self.linear.z, self.angular.x, self.angular.y, self.angular.z,
        )  # fmt: skip


def twist(vx_mps: float, vy_mps: float, wz_radps: float) -> Twist:
    return Twist(Vector3(vx_mps, vy_mps, 0.0), Vector3(0.0, 0.0, wz_radps))
