import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.links import robomaster_messages as commands
from mtm_onboard.links import robomaster_telemetry as telemetry
from mtm_onboard.links.duml import encode
from mtm_onboard.model.velocity import BodyVelocity

GOLDEN = {
    frame["name"]: bytes.fromhex(frame["bytes"])
    for frame in json.loads(Path(__file__).with_name("golden_duml.json").read_text(encoding="utf-8"))
}
FINITE = st.floats(-1e6, 1e6)


def subscribe(stream, topics, rate_hz, sequence):
    payload = telemetry.subscription_payload(telemetry.Subscription(stream, topics, rate_hz))
    return telemetry.SUBSCRIBE.message(sequence, payload)


def speed(sequence, vx, dji_vy, dji_wz_degps):
    velocity = BodyVelocity(vx, -dji_vy, -math.radians(dji_wz_degps))
    return commands.SPEED.message(sequence, commands.speed_payload(velocity))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("enable", commands.WORK_MODE.message(0, commands.work_mode_payload(True))),
        ("disable", commands.WORK_MODE.message(0, commands.work_mode_payload(False))),
        ("capture: work mode 1", commands.WORK_MODE.message(0x0609, commands.work_mode_payload(True))),
        ("capture: work mode 0", commands.WORK_MODE.message(0x07E2, commands.work_mode_payload(False))),
        ("rmc idle", commands.HEARTBEAT.message(0xE0, commands.HEARTBEAT_PAYLOAD)),
        ("vel 0 0 0 s0", speed(0, 0.0, 0.0, 0.0)),
        ("vel .5 0 0 s0", speed(0, 0.5, 0.0, 0.0)),
        ("speed .1 -.2 30", speed(1, 0.1, -0.2, 30.0)),
        ("CAN speed(-0.5,0,0) c9->c3 noack seq3", speed(3, -0.5, 0.0, 0.0)),
        ("CAN speed(3.5,-3.5,600) c9->c3 noack seq5", speed(5, 3.5, -3.5, 600.0)),
        ("capture: add node", telemetry.ADD_NODE.message(1, telemetry.add_node_payload())),
        ("capture: del stream 0", telemetry.UNSUBSCRIBE.message(5, telemetry.unsubscription_payload(0))),
        ("CAN sub velocity 50Hz stream 0 09->03 ack2 seq0", subscribe(0, (telemetry.VELOCITY,), 50, 0)),
        ("CAN sub attitude 50Hz stream 4 09->03 ack2 seq4", subscribe(4, (telemetry.ATTITUDE,), 50, 4)),
        ("CAN sub position 50Hz stream 5 09->03 ack2 seq5", subscribe(5, (telemetry.POSITION,), 50, 5)),
    ],
)
def test_a_command_is_the_published_one_byte_for_byte(name, message):
    assert encode(message) == GOLDEN[name]


@pytest.mark.parametrize(
    ("payload", "reading"),
    [
        (
            "0000204e00007b2d31010000003f0000000000000000000000 3f0000000000000000",
            (telemetry.VELOCITY, "velocity_body_mps", (0.5, 0.0)),
        ),
        ("0001204e00007b2d31010000803f000000bf00000000", (telemetry.POSITION, "position_xy_m", (1.0, 0.5))),
        ("0002204e00007b2d3101000048410000000000000000", (telemetry.ATTITUDE, "heading_rad", -math.radians(12.5))),
    ],
)
def test_a_push_is_the_published_layout(payload, reading):
    topic, name, value = reading
    here = {"velocity_body_mps": (0.0, 0.0), "velocity_start_mps": (0.5, 0.0), "position_xy_m": (0.0, 0.0)}
    told = telemetry.Telemetry(
        **{"robot_time_s": 20.000123, "received_s": 0.0, "heading_rad": 0.0, **here, name: value}
    )
    expected = bytes.fromhex(payload)
    assert telemetry.push_payload(telemetry.Subscription(expected[1], (topic,), 50), told) == expected


@given(st.builds(BodyVelocity, FINITE, FINITE, FINITE))
def test_a_velocity_has_the_precision_of_32_bit_floats(velocity):
    back = commands.speed_velocity(commands.speed_payload(velocity))
    assert back.vx_mps == float(np.float32(velocity.vx_mps))
    assert back.vy_mps == float(np.float32(velocity.vy_mps))
    assert back.wz_radps == pytest.approx(velocity.wz_radps, rel=1e-7, abs=1e-40)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e39, 1e308])
def test_a_velocity_that_no_32_bit_float_holds_is_refused(axis, bad):
    values = [0.0, 0.0, 0.0]
    values[axis] = bad
    with pytest.raises(ValueError, match=r"not finite|does not fit"):
        commands.speed_payload(BodyVelocity(*values))


def test_wheel_speeds_are_forward_positive_left_before_right():
    assert commands.wheel_rpm(bytes.fromhex("64009cff9cff6400")) == (100, 100, 100, 100)
    # Published as front right 1000, front left -1000, rear left 500, rear right -500 forward.
    assert commands.wheel_rpm(bytes.fromhex("e803e8030cfe0cfe")) == (-1000, 1000, 500, -500)


@pytest.mark.parametrize("read", [commands.speed_velocity, commands.wheel_rpm, commands.is_work_mode_on])
@given(payload=st.binary(max_size=40).filter(lambda data: len(data) not in (1, 8, 12)))
def test_a_payload_of_the_wrong_length_is_refused(read, payload):
    with pytest.raises(ValueError, match=r"bytes? long|one byte"):
        read(payload)


def test_numbers_run_for_each_pair_of_hosts_and_wrap():
    counters = commands.SequenceCounters()
    assert [counters.next(commands.SPEED) for _ in range(3)] == [0, 1, 2]
    assert [counters.next(commands.WORK_MODE), counters.next(commands.HEARTBEAT)] == [0, 1]
    for _ in range(65_536 - 3):
        counters.next(commands.SPEED)
    assert counters.next(commands.SPEED) == 0


@given(
    st.integers(0, 255),
    st.lists(st.integers(0, 2**64 - 1), max_size=20).map(tuple),
    st.integers(0, 65_535),
    st.integers(0, 255),
)
def test_a_subscription_survives_the_way_there_and_back(stream, topics, rate_hz, flags):
    subscription = telemetry.Subscription(stream, topics, rate_hz, flags=flags)
    assert telemetry.parse_subscription(telemetry.subscription_payload(subscription)) == subscription


@given(st.binary(max_size=60))
def test_a_subscription_is_either_understood_or_refused(payload):
    try:
        subscription = telemetry.parse_subscription(payload)
    except ValueError:
        return
    assert telemetry.subscription_payload(subscription) == payload


@pytest.mark.parametrize("robot_time_s", [0.0, 20.000123, 4294.967296, 5000.000001, 1_000_000.5])
def test_telemetry_survives_and_outlives_the_microseconds(robot_time_s):
    told = telemetry.Telemetry(robot_time_s, 3.0, (0.5, -0.25), (0.25, 0.5), (1.5, -2.0), 0.75)
    subscription = telemetry.Subscription(3, (telemetry.VELOCITY, telemetry.ATTITUDE, telemetry.POSITION), 50)
    back = telemetry.parse_push(telemetry.push_payload(subscription, told), subscription, 3.0)
    assert back.robot_time_s == pytest.approx(robot_time_s, abs=1e-6)
    assert back.heading_rad == pytest.approx(0.75, rel=1e-7)
    assert (back.velocity_body_mps, back.velocity_start_mps) == (told.velocity_body_mps, told.velocity_start_mps)
    assert (back.position_xy_m, back.received_s) == (told.position_xy_m, 3.0)


def test_a_push_of_another_stream_is_not_ours():
    subscription = telemetry.Subscription(3, (telemetry.VELOCITY, telemetry.ATTITUDE, telemetry.POSITION), 50)
    assert telemetry.parse_push(bytes(58), subscription, 0.0) is None
    with pytest.raises(ValueError, match="does not hold the topics"):
        telemetry.parse_push(bytes([0, 3]) + bytes(40), subscription, 0.0)
