"""Our frames, read by a second reader, and frames that others published, read by ours."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.vehicles.mavlink_firmware import COPTER, PX4, ROVER
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import (
    arm_request,
    companion_heartbeat,
    mode_request,
    telemetry,
    velocity_setpoint,
)
from mtm_onboard.links.mavlink_profiles import PROFILES
from mtm_onboard.model.velocity import BodyVelocity
from tests.onboard.links.mavlink_rig import FAKE_KEY, mavlink_rig
from tests.onboard.links.mavlink_spec import layout, read_frame, read_frames, x25

# The example frames of rust-mavlink's public tests, with the key and the sender they state.
PUBLISHED_KEY = bytes.fromhex("0001f2e3d4c5b6a79800707634320016224200ccff7a0052757374004d4156b3")
PUBLISHED_HEARTBEAT = bytes.fromhex("fd090000ef01020000000500000002035903032e73")
PUBLISHED_SIGNED = bytes.fromhex("fd090100ef0102000000050000000203590303c98b00ffffffffffff2718b168ccf5")
MOST_TIMESTAMP = (1 << 48) - 1

SPEEDS = st.floats(-1e6, 1e6, width=32)


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def codec(key=None, timestamp=lambda: 5):
    return MavlinkCodec(7, 191, key, timestamp)


def test_the_second_reader_s_checksum_has_its_check_value():
    assert x25(b"123456789") == 0x6F91


@pytest.mark.parametrize(("number", "check_byte"), [(0, 50), (30, 39), (32, 185), (76, 152), (77, 143), (84, 143)])
def test_the_second_reader_derives_the_published_check_bytes(number, check_byte):
    assert layout(number)[2] == check_byte


@pytest.mark.parametrize(
    ("frame", "key", "timestamp"), [(PUBLISHED_HEARTBEAT, None, 0), (PUBLISHED_SIGNED, PUBLISHED_KEY, MOST_TIMESTAMP)]
)
def test_published_frames_are_read_alike_by_both_readers(frame, key, timestamp):
    theirs, rest = read_frame(frame, key)
    (ours,) = codec(key, lambda: timestamp).decode(frame)
    assert rest == b""
    assert theirs.fields == {key: value for key, value in ours.to_dict().items() if key != "mavpackettype"}
    assert (ours.custom_mode, ours.type, ours.autopilot, ours.base_mode) == (5, 2, 3, 0x59)
    assert (ours.get_seq(), ours.get_srcSystem(), ours.get_srcComponent()) == (239, 1, 2)


def test_published_frames_are_written_byte_by_byte():
    for frame, key in ((PUBLISHED_HEARTBEAT, None), (PUBLISHED_SIGNED, PUBLISHED_KEY)):
        writer = MavlinkCodec(1, 2, key, lambda: MOST_TIMESTAMP)
        heartbeat = writer.messages.MAVLink_heartbeat_message(2, 3, 0x59, 5, 3, 3)
        writer._encoder.seq = 239
        assert writer.encode(heartbeat) == frame


@pytest.mark.parametrize("key", [None, FAKE_KEY])
@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
@given(vx=SPEEDS, vy=SPEEDS, wz=SPEEDS)
def test_a_set_point_reads_as_ahead_right_and_clockwise(profile, key, vx, vy, wz):
    vy = vy if profile.is_holonomic else 0.0
    ours = codec(key)
    frame, _ = read_frame(
        ours.encode(velocity_setpoint(ours.messages, profile, 9, BodyVelocity(vx, vy, wz), 12.3456)), key
    )
    fields = frame.fields
    assert (frame.name, frame.system, frame.component) == ("SET_POSITION_TARGET_LOCAL_NED", 7, 191)
    assert (fields.pop("vx"), fields.pop("vy"), fields.pop("yaw_rate")) == (single(vx), -single(vy), -single(wz))
    assert fields.pop("type_mask") == (0x05E7 if profile.name == "rover" else 0x05C7)
    assert (fields.pop("target_system"), fields.pop("target_component")) == (9, 1)
    assert fields.pop("coordinate_frame") == 8
    assert fields.pop("time_boot_ms") == 12345
    assert set(fields.values()) == {0.0}


def test_requests_read_as_what_each_firmware_expects():
    for name, firmware in (("rover", ROVER), ("copter", COPTER), ("px4", PX4)):
        ours = codec()
        data = ours.encode(mode_request(ours.messages, PROFILES[name], 3, 0))
        data += ours.encode(arm_request(ours.messages, 3, 1))
        mode, arm = read_frames(data)
        assert (mode.name, mode.fields["command"], mode.fields["param1"]) == ("COMMAND_LONG", 176, 1.0)
        assert firmware.custom_mode(mode.fields["param2"], mode.fields["param3"]) == firmware.guided_mode
        assert (arm.fields["command"], arm.fields["param1"], arm.fields["param2"]) == (400, 1.0, 0.0)
        assert (mode.fields["confirmation"], arm.fields["confirmation"]) == (0, 1)
        assert {frame.fields["target_system"] for frame in (mode, arm)} == {3}
        assert [frame.sequence for frame in (mode, arm)] == [0, 1]


@pytest.mark.parametrize("profile", PROFILES)
def test_everything_on_the_wire_is_read_by_the_second_reader(profile):
    rig = mavlink_rig(profile, set_mode=True, arm=True, vehicle={"is_guided": False, "is_armed": False})
    with rig.transport:
        rig.drive(BodyVelocity(0.5, 0.0, 0.3), 2.0)
    frames = read_frames(b"".join(rig.wire.frames))
    assert [frame.sequence for frame in frames] == [number % 256 for number in range(len(frames))]
    assert {frame.name for frame in frames} == {"HEARTBEAT", "SET_POSITION_TARGET_LOCAL_NED", "COMMAND_LONG"}
    assert {(frame.system, frame.component) for frame in frames} == {(1, 191)}
    last = [frame for frame in frames if frame.name == "SET_POSITION_TARGET_LOCAL_NED"][-3:]
    assert all(frame.fields["vx"] == frame.fields["yaw_rate"] == 0.0 for frame in last)


def test_signatures_count_up_and_never_stand_behind_the_clock():
    now = [100]
    ours = codec(FAKE_KEY, lambda: now[0])
    times = []
    for clock in (100, 100, 100, 5000, 4000):
        now[0] = clock
        frame, _ = read_frame(ours.encode(companion_heartbeat(ours.messages)), FAKE_KEY)
        times.append(frame.signature[1])
    assert times == [100, 101, 102, 5000, 5001]


@pytest.mark.parametrize("values", [(float("nan"), 0, 0), (0, float("inf"), 0), (0, 0, 1e39), (-3.5e38, 0, 0)])
def test_a_set_point_that_is_not_finite_in_32_bits_is_refused(values):
    ours = codec()
    with pytest.raises(ValueError, match="not finite"):
        velocity_setpoint(ours.messages, PROFILES["copter"], 1, BodyVelocity(*values), 0.0)


def test_a_rover_s_sideways_speed_is_refused():
    ours = codec()
    with pytest.raises(ValueError, match="the axes vx and wz"):
        velocity_setpoint(ours.messages, PROFILES["rover"], 1, BodyVelocity(0.1, 1e-9, 0.0), 0.0)
    velocity_setpoint(ours.messages, PROFILES["rover"], 1, BodyVelocity(0.1, -0.0, 0.0), 0.0)


def test_telemetry_turns_north_east_and_clockwise_into_rep_103():
    messages = codec().messages
    east = messages.MAVLink_attitude_message(0, 0.0, 0.0, 1.5707963, 0.0, 0.0, 0.25)
    moving = messages.MAVLink_local_position_ned_message(1500, 3.0, 4.0, -9.0, 0.0, 2.0, 0.0)
    told = telemetry(east, moving, 7.0)
    assert told.heading_rad == pytest.approx(-1.5707963)
    assert told.turn_rate_radps == -0.25
    assert told.velocity_body_mps == pytest.approx((2.0, 0.0), abs=1e-6)
    assert told.velocity_world_mps == (0.0, -2.0)
    assert told.position_xy_m == (3.0, -4.0)
    assert (told.robot_time_s, told.received_s) == (1.5, 7.0)
