import math
import struct

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.links import robomaster_messages as commands
from mtm_onboard.links import robomaster_telemetry as telemetry
from mtm_onboard.links.duml import Message, Parser, encode, segment
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant

ENGAGE = commands.WORK_MODE.message(0, b"\x01")
FORWARD = commands.SPEED.message(0, commands.speed_payload(BodyVelocity(0.5, 0.0, 0.0)))
POSE_AND_SPEED = (telemetry.VELOCITY, telemetry.ATTITUDE, telemetry.POSITION)


class MemoryBus:
    """The node's bus: frames in `inbox` are received, frames sent are parsed into `answers`."""

    def __init__(self):
        self.inbox = []
        self.parser = Parser()
        self.answers = []
        self.ids = set()
        self.is_broken = False

    def put(self, data, can_id=0x201):
        self.inbox += [can.Message(arbitration_id=can_id, is_extended_id=False, data=part) for part in segment(data)]

    def recv(self, timeout=None):
        return self.inbox.pop(0) if self.inbox else None

    def send(self, msg, timeout=None):
        if self.is_broken:
            raise can.CanOperationError("bus off")
        self.ids.add(msg.arbitration_id)
        self.answers += self.parser.feed(msg.data)

    def shutdown(self):
        pass


@pytest.fixture
def bus():
    return MemoryBus()


@pytest.fixture
def node(bus):
    return CanMotionController(MotionController(FloatingPlant(), deadman_s=None), bus)


def tell(node, bus, *messages, now_s=0.0):
    for message in messages:
        bus.put(encode(message))
    node.poll(now_s)


def velocity(node):
    return node.controller.plant.velocity_body


def subscribe(topics=POSE_AND_SPEED, rate_hz=50, stream=4, flags=3):
    payload = telemetry.subscription_payload(telemetry.Subscription(stream, topics, rate_hz, flags=flags))
    return telemetry.SUBSCRIBE.message(2, payload)


def test_a_robot_obeys_speed_only_in_work_mode(node, bus):
    tell(node, bus, FORWARD)
    assert velocity(node) == STOP
    tell(node, bus, ENGAGE, FORWARD)
    assert velocity(node) == BodyVelocity(0.5, 0.0, 0.0)
    tell(node, bus, commands.WORK_MODE.message(1, b"\x00"))
    assert velocity(node) == STOP


@given(*[st.floats(-3.5, 3.5, width=32)] * 2, st.floats(-600, 600, width=32))
def test_the_floats_of_the_wire_reach_the_plant_unrounded(x, y, turn_degps):
    bus = MemoryBus()
    node = CanMotionController(MotionController(FloatingPlant()), bus)
    tell(node, bus, ENGAGE, commands.SPEED.message(0, struct.pack("<fff", x, y, turn_degps)))
    assert velocity(node) == BodyVelocity(x, -y, -math.radians(turn_degps))


@pytest.mark.parametrize(
    ("payload", "expected"),
    [
        ("64009cff9cff6400", BodyVelocity(100 * 2 * math.pi * 0.05 / 60, 0.0, 0.0)),
        # Right wheels forward, left wheels back turns to the left; front right and rear left forward goes left.
        ("6400640064006400", BodyVelocity(0.0, 0.0, 100 * 2 * math.pi * 0.05 / 60 / 0.2)),
        ("640064009cff9cff", BodyVelocity(0.0, 100 * 2 * math.pi * 0.05 / 60, 0.0)),
    ],
)
def test_wheel_speeds_drive_the_robot(node, bus, payload, expected):
    tell(node, bus, ENGAGE, commands.WHEEL_SPEED.message(0, bytes.fromhex(payload)))
    assert velocity(node) == pytest.approx(expected, abs=1e-12)


def test_what_wants_an_answer_gets_one_and_nothing_else_does(node, bus):
    tell(node, bus, ENGAGE, FORWARD)
    assert bus.answers == [
        Message(sender=0xC3, receiver=0x09, sequence=0, attributes=0x80, cmdset=0x3F, cmdid=0x19, payload=b"\x00")
    ]
    assert bus.ids == {0x202}


def test_a_published_wheel_command_gets_the_published_answer(node, bus):
    bus.put(bytes.fromhex("551504a9c9c36b0440 3f2000000000000000004617"))
    node.poll(0.0)
    assert [encode(answer).hex() for answer in bus.answers] == ["550e0466c3c96b04803f2000d530"]


def test_a_speed_that_is_not_finite_is_a_fault(node, bus):
    bad = commands.SPEED.message(1, struct.pack("<fff", math.nan, 0.0, 0.0))
    tell(node, bus, ENGAGE, FORWARD, bad)
    assert velocity(node) == BodyVelocity(0.5, 0.0, 0.0)
    assert node.faults == 1


def test_a_broken_message_is_a_fault_and_the_one_after_is_obeyed(node, bus):
    broken = bytearray(encode(FORWARD))
    broken[15] ^= 0x10
    bus.put(encode(ENGAGE))
    bus.put(bytes(broken))
    tell(node, bus, FORWARD)
    assert node.faults >= 1
    assert velocity(node) == BodyVelocity(0.5, 0.0, 0.0)


@pytest.mark.parametrize("message", [commands.WORK_MODE.message(1, b"\x07"), telemetry.SUBSCRIBE.message(1, b"\x09")])
def test_a_payload_that_contradicts_its_command_is_refused(node, bus, message):
    tell(node, bus, message)
    assert node.malformed_messages == 1
    assert [answer.payload for answer in bus.answers] == [b"\x01"]


def test_what_the_robot_does_not_know_is_counted(node, bus):
    light = Message(sender=0x09, receiver=0x18, sequence=0, attributes=0x40, cmdset=0x3F, cmdid=0x32, payload=bytes(13))
    ping = Message(sender=0x0A, receiver=0xC3, sequence=0, attributes=0x40, cmdset=0x00, cmdid=0x01)
    push_answer = Message(
        sender=0x09, receiver=0x03, sequence=0, attributes=0xA0, cmdset=0x48, cmdid=0x08, payload=b"\x01"
    )
    tell(node, bus, light, ping, push_answer)
    assert node.ignored_messages == 3
    assert bus.answers == []


def test_frames_of_other_nodes_are_not_listened_to(node, bus):
    bus.put(encode(ENGAGE), can_id=0x203)
    node.poll(0.0)
    assert not node.controller.work_mode


def test_heartbeats_to_either_half_of_the_robot_are_counted(node, bus):
    tell(node, bus, commands.HEARTBEAT.message(0, commands.HEARTBEAT_PAYLOAD))
    tell(
        node,
        bus,
        Message(
            sender=0x09,
            receiver=0x03,
            sequence=0,
            attributes=0,
            cmdset=0x3F,
            cmdid=0x60,
            payload=commands.HEARTBEAT_PAYLOAD,
        ),
    )
    assert node.heartbeats == 2


def pushes(bus):
    return [message for message in bus.answers if telemetry.PUSH.matches(message)]


@pytest.mark.parametrize(("rate_hz", "poll_ms"), [(50, 10), (50, 1), (10, 10), (200, 1), (30, 1)])
def test_a_subscription_is_pushed_at_the_asked_rate(node, bus, rate_hz, poll_ms):
    tell(node, bus, subscribe(rate_hz=rate_hz), now_s=0.0)
    for now_ms in range(poll_ms, 2000 + poll_ms, poll_ms):
        node.poll(now_ms / 1000)
    assert len(pushes(bus)) == 2 * rate_hz
    assert [message.sequence for message in pushes(bus)] == list(range(2 * rate_hz))


def test_pushes_that_were_missed_are_skipped(node, bus):
    tell(node, bus, subscribe(), now_s=0.0)
    node.poll(1.0)
    node.poll(1.01)
    node.poll(1.02)
    assert len(pushes(bus)) == 2


def test_a_push_carries_its_stream_and_the_robots_time(node, bus):
    tell(node, bus, subscribe(topics=(telemetry.POSITION,), stream=4), now_s=0.0)
    node.poll(0.02)
    assert pushes(bus)[0].payload == bytes.fromhex("000414000000204e0000") + bytes(12)


def test_an_unstamped_subscription_is_pushed_without_time(node, bus):
    tell(node, bus, subscribe(topics=(telemetry.POSITION,), stream=4, flags=0), now_s=0.0)
    node.poll(0.02)
    assert pushes(bus)[0].payload == bytes.fromhex("0004") + bytes(12)


def test_the_pushed_pose_is_relative_to_switching_on(bus):
    plant = FloatingPlant()
    plant.command(0.0, BodyVelocity(1.0, 0.0, math.pi / 2))
    plant.step(1.0)  # one metre forward, then facing left
    node = CanMotionController(MotionController(plant, deadman_s=None), bus)
    tell(node, bus, ENGAGE, FORWARD, subscribe(), now_s=1.0)
    node.poll(3.0)
    subscription = telemetry.Subscription(4, POSE_AND_SPEED, 50)
    told = telemetry.parse_push(pushes(bus)[-1].payload, subscription, 0.0)
    assert plant.position_xy_m == pytest.approx((1.0, 1.0))
    assert told.position_xy_m == pytest.approx((1.0, 0.0))
    assert told.velocity_start_mps == pytest.approx((0.5, 0.0))
    assert told.heading_rad == 0.0


def test_the_end_of_a_subscription_ends_the_pushes(node, bus):
    tell(node, bus, subscribe(stream=4), now_s=0.0)
    end = telemetry.UNSUBSCRIBE.message(3, telemetry.unsubscription_payload(4))
    tell(node, bus, end, now_s=0.001)
    node.poll(1.0)
    assert pushes(bus) == []
    assert bus.answers[-1].payload == b"\x00"


def test_an_unknown_topic_is_named_and_the_others_are_pushed(node, bus):
    tell(node, bus, subscribe(topics=(telemetry.POSITION, 0x0002000391A13D9C, telemetry.ATTITUDE)))
    assert bus.answers[-1].payload == bytes.fromhex("00030004 9c3da191")
    node.poll(0.02)
    assert len(bus.answers[-1].payload) == 2 + 8 + 12 + 12


def test_seven_topics_are_pushed_where_the_client_looks(node, bus):
    bus.put(
        bytes.fromhex(
            "554c046c090302004048030901030007a702298803000200663e3e4c03000200fbdcf5d70300020009a326e203000200"
            "f41d1cdc0300020042ee131d03000200b3f7e64703000200320035 76"
        )
    )
    tell(node, bus, ENGAGE, FORWARD)
    node.poll(0.02)
    (push,) = [message for message in bus.answers if telemetry.PUSH.matches(message)]
    message = encode(push)
    assert len(message) == 155
    # The client's offsets count from the attributes, the ninth byte.
    body_mps = struct.unpack_from("<6f", message, 8 + 27)[3:]
    rpm = struct.unpack_from("<4h", message, 8 + 61)
    assert body_mps == pytest.approx((0.5, 0.0, 0.0))
    assert rpm == (95, -95, -95, 95)
    assert struct.unpack_from("<6f", message, 8 + 97)[2] == -1.0
    assert struct.unpack_from("<H", message, 8 + 51)[0] > 11_000


def test_a_node_that_is_reset_has_no_streams(node, bus):
    tell(node, bus, subscribe(), telemetry.RESET_NODE.message(3, b"\x09"))
    node.poll(0.1)
    assert not [message for message in bus.answers if telemetry.PUSH.matches(message)]


def test_a_robot_that_cannot_engage_says_so_and_stands_still(bus):
    node = CanMotionController(MotionController(FloatingPlant()), bus, can_engage=False)
    tell(node, bus, ENGAGE, FORWARD)
    (answer,) = bus.answers
    assert (answer.sender, answer.receiver, answer.attributes) == (0xC3, 0x09, 0x80)
    assert (answer.cmdset, answer.cmdid, answer.payload) == (0x3F, 0x19, b"\x01")
    assert velocity(node) == STOP


@pytest.mark.parametrize("wanted", [subscribe(rate_hz=0), subscribe(rate_hz=201)])
def test_a_rate_the_robot_cannot_serve_is_refused(node, bus, wanted):
    tell(node, bus, wanted, now_s=0.0)
    node.poll(1.0)
    assert [answer.payload[0] for answer in bus.answers] == [1]


def test_a_granted_subscription_is_answered(node, bus):
    tell(node, bus, telemetry.ADD_NODE.message(1, telemetry.add_node_payload()), subscribe(stream=4))
    assert [answer.payload.hex() for answer in bus.answers] == ["0003", "0003000400000000"]


def test_a_bus_that_takes_no_answers_still_brings_commands(node, bus):
    bus.is_broken = True
    tell(node, bus, ENGAGE, FORWARD)
    assert node.bus_errors == 1
    assert velocity(node) == BodyVelocity(0.5, 0.0, 0.0)


@given(st.lists(st.binary(min_size=1, max_size=40), max_size=10))
def test_no_noise_on_the_bus_makes_an_engaged_robot_move(portions):
    bus = MemoryBus()
    node = CanMotionController(MotionController(FloatingPlant()), bus)
    tell(node, bus, ENGAGE)
    for portion in portions:
        bus.put(portion)
        node.poll(0.0)
    assert velocity(node) == STOP
