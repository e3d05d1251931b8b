"""DJI's own client and codec write and read the same bytes as ours."""

import json
import sys

import pytest

from hil.plants.mecanum import RIM_MPS_PER_RPM
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.links import robomaster_messages as commands
from mtm_onboard.links import robomaster_telemetry as telemetry
from mtm_onboard.links.duml import Message, Parser, encode
from mtm_onboard.model.velocity import BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.hil.vehicles.test_can_node import MemoryBus
from tests.peers.conftest import PEERS, ROOT, installed

pytestmark = pytest.mark.peer

TOPICS = (telemetry.VELOCITY, telemetry.ATTITUDE, telemetry.POSITION)
FIRST_STREAM = 20
# What the noise adds is far below the steps to which DJI's client rounds.
QUIET = BodyVelocity(0.123456, -0.0123456, 0.0321)


class Codec:
    """DJI's codec in a process of its own, with the messages that its client sent."""

    def __init__(self, process) -> None:
        self._process = process
        process.wait_for('"done"')
        self.sent = [bytes.fromhex(fact["sent"]) for fact in map(json.loads, process.lines) if "sent" in fact]

    def read(self, *messages: bytes) -> list[dict]:
        """What DJI's codec makes of messages."""
        first = len(self._process.lines)
        for message in messages:
            self._process.say(message.hex())
        self._process.say("")
        assert self._process.end() == 0, self._process.output
        return [json.loads(line) for line in self._process.lines[first:]]


@pytest.fixture
def dji(start):
    installed("dji", "robomaster/protocol.py")
    return Codec(start(sys.executable, ROOT / "tests/peers/robomaster/dji_codec.py", PEERS / "dji", *TOPICS))


@pytest.fixture
def bus():
    return MemoryBus()


@pytest.fixture
def node(bus):
    return CanMotionController(MotionController(FloatingPlant(), deadman_s=None), bus)


def test_what_dji_s_client_sends_is_parsed_and_encodes_the_same(dji):
    parser = Parser()
    messages = parser.feed(b"".join(dji.sent))
    assert [encode(message) for message in messages] == dji.sent
    assert (parser.dropped_bytes, parser.header_failures, parser.checksum_failures) == (0, 0, 0)


def test_dji_s_client_drives_the_simulated_robot(dji, bus, node):
    driven = []
    for number, data in enumerate(dji.sent):
        bus.put(data)
        node.poll(0.01 * number)
        driven.append(node.controller.plant.velocity_body)
    assert (node.ignored_messages, node.malformed_messages, node.faults) == (0, 0, 0)
    by_speed, by_wheels, again = driven[5:8]
    assert by_speed == pytest.approx((0.37, 0.21, -0.4363), abs=1e-4)
    assert by_wheels.vx_mps == pytest.approx(45 * RIM_MPS_PER_RPM)
    assert again == pytest.approx((0.5, -0.25, 0.5236), abs=1e-4)


def test_dji_s_codec_understands_the_simulated_robot_s_answers(dji, bus, node):
    for data in dji.sent:
        bus.put(data)
    node.poll(0.0)
    node.poll(1.0)
    told = dji.read(*map(encode, bus.answers))
    assert all(fact["understood"] and fact["rest"] == 0 for fact in told)
    answered = [fact for fact in told if fact["answer"]]
    assert [fact["command"] for fact in answered] == [
        [0x48, 1],
        *[[0x48, 3]] * 3,
        [0x3F, 0x19],
        [0x3F, 0x20],
        [0x48, 4],
    ]
    pushed = {fact["subject"]: fact["values"] for fact in told if not fact["answer"]}
    assert pushed["velocity"][3:] == pytest.approx([0.5, 0.25, 0.0], abs=0.01)
    assert pushed["position"] == pytest.approx([0.0, 0.0, 0.0], abs=2.0)
    assert set(pushed) == {"velocity", "position"}


def test_dji_s_codec_reads_our_commands_without_loss(dji):
    wish = telemetry.Subscription(FIRST_STREAM, (telemetry.VELOCITY,), 50)
    ours: list[Message] = [
        commands.WORK_MODE.message(7, commands.work_mode_payload(True)),
        commands.SPEED.message(8, commands.speed_payload(QUIET)),
        commands.HEARTBEAT.message(9, commands.HEARTBEAT_PAYLOAD),
        telemetry.SUBSCRIBE.message(10, telemetry.subscription_payload(wish)),
    ]
    told = dji.read(*map(encode, ours))
    for fact, message in zip(told, ours, strict=True):
        assert fact["host"] == [message.sender, message.receiver]
        assert (fact["sequence"], fact["payload"]) == (message.sequence, message.payload.hex())
        assert fact["command"] == [message.cmdset, message.cmdid]
        assert (fact["answer"], fact["need_ack"] << 5, fact["rest"]) == (False, message.attributes, 0)
    assert told[1]["speed"] == pytest.approx([0.123456, 0.0123456, -1.839194], abs=1e-6)
