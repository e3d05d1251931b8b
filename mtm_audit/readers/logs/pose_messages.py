"""Poses in messages of any make: ROS, Foxglove, protobuf or JSON, whose fields have the same few names."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mtm_audit.model.track import Floats

# Messages that are poses, whatever package and language their definitions come from.
POSE_TYPES = frozenset({
    "Odometry", "PoseStamped", "PoseWithCovarianceStamped", "TransformStamped", "PointStamped", "Path", "PoseInFrame",
    "PosesInFrame",
})  # fmt: skip
TRANSFORM_TYPES = frozenset({"TFMessage", "tfMessage", "FrameTransform", "FrameTransforms"})

_ROOTS = (("pose", "pose"), ("pose",), ("transform",), ())
_PLACES, _TURNS = ("position", "translation", "point"), ("orientation", "rotation")
_STAMPS = (("header", "stamp"), ("timestamp",), ("stamp",))
_SECONDS, _PARTS = ("sec", "seconds", "secs"), ("nanosec", "nanos", "nsec", "nsecs")


@dataclass
class Samples:
    """Poses in the order in which they were recorded; stamps and arrivals in nanoseconds."""

    stamps_ns: list[int] = field(default_factory=list)
    arrivals_ns: list[int] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    turns: list[tuple[float, float, float, float]] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.places)

    @property
    def stamped(self) -> bool:
        """Whether the stamps tell the instants apart; some programs leave them all at zero."""
        return len(set(self.stamps_ns)) > len(self.stamps_ns) // 2

    def times_s(self, *, arrival: bool) -> Floats:
        """Instants in seconds, shape (n,)."""
        return np.array(self.arrivals_ns if arrival else self.stamps_ns, dtype=float) * 1e-9

    def positions(self) -> Floats:
        """Shape (n, 3), in the messages' unit."""
        return np.array(self.places, dtype=float).reshape(-1, 3)

    def quaternions_xyzw(self) -> Floats | None:
        """Shape (n, 4); None when no message has one."""
        turns = np.array(self.turns, dtype=float).reshape(-1, 4)
        return turns if np.any(np.isfinite(turns)) and np.any(turns) else None

    def add(self, stamp_ns: int, arrival_ns: int, pose: "Pose") -> None:
        """Take one more pose."""
        self.stamps_ns.append(stamp_ns)
        self.arrivals_ns.append(arrival_ns)
        self.places.append(pose[:3])
        self.turns.append(pose[3:])


Pose = tuple[float, float, float, float, float, float, float]


def type_name(full_name: str) -> str:
    """The name without its package: Odometry of nav_msgs/msg/Odometry, PoseInFrame of foxglove.PoseInFrame."""
    return full_name.replace(".", "/").rpartition("/")[2]


def fields_of(message: Any, *path: str) -> Any:
    """What is at the end of a path of names in a message; None when there is nothing."""
    for name in path:
        message = message.get(name) if isinstance(message, dict) else getattr(message, name, None)
        if message is None:
            return None
    return message


def stamp_ns_of(message: Any) -> int:
    """The instant that a message carries, in nanoseconds; 0 when it carries none."""
    for path in _STAMPS:
        stamp = fields_of(message, *path)
        if stamp is None or isinstance(stamp, str):
            continue
        if isinstance(stamp, int | float):
            # Plain numbers are seconds, or nanoseconds where only those can be as large.
            return int(stamp) if stamp > 1e15 else round(stamp * 1e9)
        seconds = next((value for key in _SECONDS if (value := fields_of(stamp, key)) is not None), 0)
        parts = next((value for key in _PARTS if (value := fields_of(stamp, key)) is not None), 0)
        return int(seconds) * 1_000_000_000 + int(parts)
    return 0


def pose_of(message: Any) -> Pose | None:
    """The position and quaternion (x, y, z, w) of a message, NaN where it has no turn; None when it has no position."""
    for root in _ROOTS:
        inner = fields_of(message, *root)
        place = next((value for key in _PLACES if (value := fields_of(inner, key)) is not None), None)
        if place is not None and fields_of(place, "x") is not None:
            turn = next((value for key in _TURNS if (value := fields_of(inner, key)) is not None), None)
            return (*_numbers(place, "xyz"), *_turn(turn))
    if fields_of(message, "x") is None or fields_of(message, "y") is None:
        return None
    x, y, z = _numbers(message, "xyz")
    yaw = fields_of(message, "theta")
    half = np.nan if yaw is None else 0.5 * float(yaw)
    return x, y, z, 0.0 * half, 0.0 * half, float(np.sin(half)), float(np.cos(half))


def poses_of(message: Any, kind: str) -> Iterator[tuple[str, str, int, Pose]]:
    """Parent frame, child frame, stamp and pose of each pose or transform in a message."""
    for item in _items(message, kind):
        pose = pose_of(item)
        if pose is not None:
            yield _frame(item, "parent_frame_id", "frame_id"), _frame(item, "child_frame_id"), stamp_ns_of(item), pose


def _items(message: Any, kind: str) -> Iterable[Any]:
    if kind in ("TFMessage", "tfMessage", "FrameTransforms"):
        return fields_of(message, "transforms") or ()
    if kind in ("Path", "PosesInFrame"):
        return fields_of(message, "poses") or ()
    return (message,)


def _frame(item: Any, *keys: str) -> str:
    for key in keys:
        name = fields_of(item, key) or fields_of(item, "header", key)
        if name:
            return str(name).strip("/")
    return ""


def _numbers(value: Any, names: str) -> Any:
    return tuple(float(number) if (number := fields_of(value, name)) is not None else 0.0 for name in names)


def _turn(value: Any) -> tuple[float, float, float, float]:
    if value is None or fields_of(value, "w") is None:
        return np.nan, np.nan, np.nan, np.nan
    turn: tuple[float, float, float, float] = _numbers(value, "xyzw")
    return turn
