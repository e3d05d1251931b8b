"""The robot's end of the CAN wire: the motion controller as a node on the bus."""

from collections.abc import Callable
from dataclasses import dataclass

from hil.plants.mecanum import RIM_MPS_PER_RPM, body_velocity
from hil.vehicles.can_topics import KNOWN_TOPICS, pushed_data
from hil.vehicles.motion_controller import MotionController
from hil.vehicles.odometry import Odometry, turned
from mtm_onboard.links.can_bus import Bus
from mtm_onboard.links.can_stream import CanStream
from mtm_onboard.links.duml import ACK, WANTS_ACK, Message
from mtm_onboard.links.robomaster_messages import (
    CHASSIS,
    FROM_COMPANION_ID,
    FROM_MOTION_CONTROLLER_ID,
    HEARTBEAT,
    PUBLISHER,
    SPEED,
    WHEEL_SPEED,
    WORK_MODE,
    SequenceCounters,
    is_work_mode_on,
    speed_velocity,
    wheel_rpm,
)
from mtm_onboard.links.robomaster_telemetry import (
    ADD_NODE,
    PUSH,
    RESET_NODE,
    SUBSCRIBE,
    UNSUBSCRIBE,
    Subscription,
    Telemetry,
    parse_subscription,
    parse_unsubscription,
    push_head,
)
from mtm_onboard.protocol import MtmError

MOST_PUSHES_HZ = 200

_DONE = b"\x00"
_REFUSED = b"\x01"
# A push that is due within this part of a period counts as due: instants are sums of decimal fractions.
_PUSH_SLACK = 1e-6


@dataclass
class _Stream:
    """A running subscription: pushes are counted from `since_s`."""

    subscription: Subscription
    since_s: float
    last: int = 0

    def is_due(self, now_s: float) -> bool:
        """Whether a push is due; those that were missed are skipped."""
        number = int((now_s - self.since_s) * self.subscription.rate_hz + _PUSH_SLACK)
        due = number > self.last
        self.last = number
        return due


class CanMotionController:
    """Obeys what arrives on CAN id 0x201 and answers on 0x202; `poll` does everything that is due.

    Obeyed are work mode, speed, wheel speed, and the subscription commands; heartbeats are counted. Anything else,
    and answers, are counted in `ignored_messages`; payloads that contradict their command in `malformed_messages`.
    Pushed poses are relative to the pose at construction, as a robot's are to where it was switched on. Topics of a
    subscription that are not known are left out of its pushes, and the first is named in the answer.

    `can_engage` False is a robot that answers the work mode with an error, and `acknowledges` False one that answers
    no work mode.
    """

    def __init__(
        self, controller: MotionController, bus: Bus, *, can_engage: bool = True, acknowledges: bool = True
    ) -> None:
        self.controller = controller
        self.can_engage = can_engage
        self.acknowledges = acknowledges
        self.heartbeats = 0
        self.ignored_messages = 0
        self.malformed_messages = 0
        self.bus_errors = 0
        self._wire = CanStream(bus, FROM_MOTION_CONTROLLER_ID, FROM_COMPANION_ID)
        self._sequence = SequenceCounters()
        self._streams: dict[int, _Stream] = {}
        self._odometry = Odometry(controller.plant)
        self._handlers: dict[tuple[int, int, int], Callable[[Message, float], bytes | None]] = {
            (kind.receiver, kind.cmdset, kind.cmdid): handler
            for kind, handler in (
                (SPEED, self._on_speed),
                (WHEEL_SPEED, self._on_wheel_speed),
                (WORK_MODE, self._on_work_mode),
                (ADD_NODE, self._on_add_node),
                (RESET_NODE, self._on_reset_node),
                (SUBSCRIBE, self._on_subscribe),
                (UNSUBSCRIBE, self._on_unsubscribe),
            )
        }
        for host in (CHASSIS, PUBLISHER):  # open libraries address the heartbeat to either half
            self._handlers[host, HEARTBEAT.cmdset, HEARTBEAT.cmdid] = self._on_heartbeat

    @property
    def faults(self) -> int:
        """Messages with a wrong checksum, and commands that were not finite."""
        return self._wire.parser.checksum_failures + self._wire.parser.header_failures + self.controller.faults

    def poll(self, now_s: float) -> None:
        """Obey what has arrived, advance the plant to `now_s` and push what is due."""
        for message in self._received():
            self._obey(message, now_s)
        self.controller.advance(now_s)
        for stream in self._streams.values():
            if stream.is_due(now_s):
                self._send(PUSH.message(self._sequence.next(PUSH), self._push(stream.subscription, now_s)))

    def shutdown(self) -> None:
        """Leave the bus."""
        self._wire.shutdown()

    def _received(self) -> list[Message]:
        try:
            return self._wire.read()
        except MtmError:
            self.bus_errors += 1
            return []

    def _send(self, message: Message) -> None:
        try:
            self._wire.write(message)
        except MtmError:
            self.bus_errors += 1

    def _obey(self, message: Message, now_s: float) -> None:
        handler = self._handlers.get((message.receiver, message.cmdset, message.cmdid))
        if handler is None or message.attributes & ACK:
            self.ignored_messages += 1
            return
        try:
            answer = handler(message, now_s)
        except ValueError:
            self.malformed_messages += 1
            answer = _REFUSED
        if answer is not None and message.attributes & WANTS_ACK:
            self._send(message.answer(answer))

    def _on_speed(self, message: Message, now_s: float) -> bytes:
        self.controller.command_speed(now_s, *speed_velocity(message.payload))
        return _DONE

    def _on_wheel_speed(self, message: Message, now_s: float) -> bytes:
        one, two, three, four = (rpm * RIM_MPS_PER_RPM for rpm in wheel_rpm(message.payload))
        self.controller.command_speed(now_s, *body_velocity((one, two, three, four)))
        return _DONE

    def _on_work_mode(self, message: Message, _now_s: float) -> bytes | None:
        is_on = is_work_mode_on(message.payload)
        if is_on and not self.can_engage:
            return _REFUSED
        self.controller.set_work_mode(is_on)
        return _DONE if self.acknowledges else None

    def _on_heartbeat(self, _message: Message, _now_s: float) -> None:
        self.heartbeats += 1

    def _on_add_node(self, _message: Message, _now_s: float) -> bytes:
        return _DONE + bytes((PUBLISHER,))

    def _on_reset_node(self, _message: Message, _now_s: float) -> bytes:
        self._streams.clear()
        return _DONE

    def _on_subscribe(self, message: Message, now_s: float) -> bytes:
        wanted = parse_subscription(message.payload)
        unknown = next((topic for topic in wanted.topics if topic not in KNOWN_TOPICS), 0)
        granted = 1 <= wanted.rate_hz <= MOST_PUSHES_HZ
        if granted:
            self._streams[wanted.stream] = _Stream(wanted, now_s)
        head = _DONE if granted else _REFUSED
        return head + bytes((PUBLISHER, 0, wanted.stream)) + (unknown & 0xFFFFFFFF).to_bytes(4, "little")

    def _on_unsubscribe(self, message: Message, _now_s: float) -> bytes:
        known = self._streams.pop(parse_unsubscription(message.payload), None) is not None
        return _DONE if known else _REFUSED

    def _push(self, subscription: Subscription, now_s: float) -> bytes:
        telemetry, velocity = self._telemetry(now_s), self.controller.plant.velocity_body
        data = [pushed_data(topic, telemetry, velocity) for topic in subscription.topics]
        return push_head(subscription, now_s) + b"".join(data)

    def _telemetry(self, now_s: float) -> Telemetry:
        body_x, body_y, _ = self.controller.plant.velocity_body
        odometry = self._odometry
        return Telemetry(
            robot_time_s=now_s,
            received_s=now_s,
            velocity_body_mps=(body_x, body_y),
            velocity_start_mps=turned(body_x, body_y, odometry.heading_rad),
            position_xy_m=odometry.position_xy_m,
            heading_rad=odometry.heading_rad,
        )
