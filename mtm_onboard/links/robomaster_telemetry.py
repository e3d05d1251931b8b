"""The RoboMaster's telemetry: subscribing to topics, and the pushes that carry them.

A subscriber names topics and a rate; the robot then pushes them back to back in the order asked for, after its own
time stamp. Topic numbers and layouts follow DJI's open SDK and two open CAN libraries that agree on them.
"""

import struct
from dataclasses import dataclass
from typing import Final

from mtm_onboard.links.duml import WANTS_ACK_NOW, WANTS_ACK_WHEN_DONE
from mtm_onboard.links.robomaster_messages import (
    COMPANION,
    PUBLISHER,
    Kind,
    clockwise_deg,
    counter_clockwise_rad,
    flipped,
)

ADD_NODE: Final = Kind(COMPANION, PUBLISHER, WANTS_ACK_WHEN_DONE, 0x48, 0x01)
RESET_NODE: Final = Kind(COMPANION, PUBLISHER, WANTS_ACK_WHEN_DONE, 0x48, 0x02)
SUBSCRIBE: Final = Kind(COMPANION, PUBLISHER, WANTS_ACK_WHEN_DONE, 0x48, 0x03)
UNSUBSCRIBE: Final = Kind(COMPANION, PUBLISHER, WANTS_ACK_WHEN_DONE, 0x48, 0x04)
PUSH: Final = Kind(PUBLISHER, COMPANION, WANTS_ACK_NOW, 0x48, 0x08)

VELOCITY: Final = 0x000200034C3E3E66
ATTITUDE: Final = 0x000200031D13EE42
POSITION: Final = 0x0002000347E6F7B3

_ADD_NODE_VERSION = 0x03000000
_STAMPED = 0x01
_STOP_WHEN_GONE = 0x02
_PERIODIC = 0
_NODE = struct.Struct("<BI")
_SUBSCRIPTION = struct.Struct("<BBBBB")
_TOPIC = struct.Struct("<Q")
_RATE = struct.Struct("<H")
_UNSUBSCRIPTION = struct.Struct("<BBB")
_PUSH = struct.Struct("<BB")
_STAMP = struct.Struct("<II")
_WORD = 0xFFFFFFFF
_LAYOUTS = {VELOCITY: struct.Struct("<6f"), ATTITUDE: struct.Struct("<3f"), POSITION: struct.Struct("<3f")}

TOPICS: Final = frozenset(_LAYOUTS)


@dataclass(frozen=True)
class Subscription:
    """What a subscriber asks for: topics (in the order they are pushed) at `rate_hz` under the number `stream`."""

    stream: int
    topics: tuple[int, ...]
    rate_hz: int
    node: int = COMPANION
    flags: int = _STAMPED | _STOP_WHEN_GONE

    @property
    def is_stamped(self) -> bool:
        """Whether pushes carry the robot's time."""
        return bool(self.flags & _STAMPED)


@dataclass(frozen=True)
class Telemetry:
    """The robot's own estimate, in REP-103 signs, relative to where and how it stood when it was switched on.

    `robot_time_s` is the robot's clock at the push, `received_s` ours on reading it. Velocities are (x, y) in m/s,
    in the body's frame and in that of the start; the robot reports no turn rate.
    """

    robot_time_s: float
    received_s: float
    velocity_body_mps: tuple[float, float]
    velocity_start_mps: tuple[float, float]
    position_xy_m: tuple[float, float]
    heading_rad: float


def add_node_payload(node: int = COMPANION) -> bytes:
    """Payload that announces a subscriber."""
    return _NODE.pack(node, _ADD_NODE_VERSION)


def subscription_payload(subscription: Subscription) -> bytes:
    """Payload that asks for periodic pushes."""
    topics = subscription.topics
    head = _SUBSCRIPTION.pack(
        subscription.node, subscription.stream, subscription.flags, _PERIODIC, len(subscription.topics)
    )
    return head + b"".join(map(_TOPIC.pack, topics)) + _RATE.pack(subscription.rate_hz)


def parse_subscription(payload: bytes) -> Subscription:
    """The inverse of `subscription_payload`; raises ValueError when the payload contradicts itself."""
    if len(payload) < _SUBSCRIPTION.size:
        raise ValueError(f"a subscription of {len(payload)} bytes is too short")
    node, stream, flags, mode, count = _SUBSCRIPTION.unpack_from(payload)
    rate_at = _SUBSCRIPTION.size + count * _TOPIC.size
    if mode != _PERIODIC or len(payload) != rate_at + _RATE.size:
        raise ValueError(f"a subscription to {count} topics in mode {mode} and {len(payload)} bytes is not understood")
    topics = tuple(topic for (topic,) in _TOPIC.iter_unpack(payload[_SUBSCRIPTION.size : rate_at]))
    return Subscription(stream, topics, _RATE.unpack_from(payload, rate_at)[0], node, flags)


def unsubscription_payload(stream: int, node: int = COMPANION) -> bytes:
    """Payload that ends a stream of pushes."""
    return _UNSUBSCRIPTION.pack(_PERIODIC, node, stream)


def parse_unsubscription(payload: bytes) -> int:
    """The stream to end; raises ValueError when the payload has another length."""
    if len(payload) != _UNSUBSCRIPTION.size:
        raise ValueError(f"the end of a subscription is {_UNSUBSCRIPTION.size} bytes long, not {len(payload)}")
    return int(payload[2])


def push_payload(subscription: Subscription, telemetry: Telemetry) -> bytes:
    """Payload of one push of topics that are known here, as the robot sends it."""
    data = b"".join([topic_data(topic, telemetry) for topic in subscription.topics])
    return push_head(subscription, telemetry.robot_time_s) + data


def push_head(subscription: Subscription, robot_time_s: float) -> bytes:
    """What stands before the topics in the payload of a push."""
    head = _PUSH.pack(_PERIODIC, subscription.stream)
    if subscription.is_stamped:
        stamp_us = round(robot_time_s * 1e6)
        head += _STAMP.pack(stamp_us // 1000 & _WORD, stamp_us & _WORD)
    return head


def parse_push(payload: bytes, subscription: Subscription, received_s: float) -> Telemetry | None:
    """The telemetry of one push, or None when it belongs to another stream.

    Needs a stamped subscription to velocity, attitude and position; raises ValueError when the length is wrong.
    """
    if len(payload) < _PUSH.size or payload[1] != subscription.stream:
        return None
    data_at = _PUSH.size + _STAMP.size
    if len(payload) != data_at + sum(_LAYOUTS[topic].size for topic in subscription.topics):
        raise ValueError(f"a push of {len(payload)} bytes does not hold the topics that were asked for")
    stamp_ms, stamp_us = _STAMP.unpack_from(payload, _PUSH.size)
    values: dict[int, tuple[float, ...]] = {}
    for topic in subscription.topics:
        values[topic] = _LAYOUTS[topic].unpack_from(payload, data_at)
        data_at += _LAYOUTS[topic].size
    start_x, start_y, _, body_x, body_y, _ = values[VELOCITY]
    x_m, y_m, _ = values[POSITION]
    return Telemetry(
        # The microseconds wrap after 71 minutes, the milliseconds after 49 days: the first refine the second.
        robot_time_s=(1000 * stamp_ms + (stamp_us - 1000 * stamp_ms & _WORD)) * 1e-6,
        received_s=received_s,
        velocity_body_mps=(body_x, flipped(body_y)),
        velocity_start_mps=(start_x, flipped(start_y)),
        position_xy_m=(x_m, flipped(y_m)),
        heading_rad=counter_clockwise_rad(values[ATTITUDE][0]),
    )


def topic_data(topic: int, telemetry: Telemetry) -> bytes:
    """The bytes of one of `TOPICS` in a push."""
    layout = _LAYOUTS[topic]
    if topic == VELOCITY:
        start_x, start_y = telemetry.velocity_start_mps
        body_x, body_y = telemetry.velocity_body_mps
        return layout.pack(start_x, flipped(start_y), 0.0, body_x, flipped(body_y), 0.0)
    if topic == ATTITUDE:
        return layout.pack(clockwise_deg(telemetry.heading_rad), 0.0, 0.0)
    return layout.pack(telemetry.position_xy_m[0], flipped(telemetry.position_xy_m[1]), 0.0)
