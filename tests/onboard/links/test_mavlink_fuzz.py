"""Whatever comes over the wire: neither end crashes or hangs, and nothing is obeyed that was not sent."""

from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import arm_request, companion_heartbeat, mode_request, velocity_setpoint
from mtm_onboard.links.mavlink_profiles import PROFILES
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.onboard.links.mavlink_rig import FAKE_KEY, mavlink_rig

FORWARD = BodyVelocity(0.5, 0.0, 0.0)
COPTER = PROFILES["copter"]


def frames(key=None):
    """One of each kind that a companion sends, as from a fresh link."""
    codec = MavlinkCodec(1, 191, key, lambda: 10**12 + 1000)
    messages = codec.messages
    return [
        codec.encode(message)
        for message in (
            companion_heartbeat(messages),
            velocity_setpoint(messages, COPTER, 1, FORWARD, 1.0),
            mode_request(messages, COPTER, 1, 0),
            arm_request(messages, 1, 0),
        )
    ]


# MAVLink starts a frame with one of two bytes, which chance alone would seldom hit.
NOISE = st.lists(st.one_of(st.binary(max_size=40), st.sampled_from([b"\xfd", b"\xfe", b"\xfd\x35\x01"]))).map(b"".join)


@st.composite
def damaged(draw, key=None):
    """A frame with between one and three of its bytes changed, or with a part cut out."""
    frame = bytearray(draw(st.sampled_from(frames(key))))
    if draw(st.booleans()):
        for _ in range(draw(st.integers(1, 3))):
            frame[draw(st.integers(0, len(frame) - 1))] ^= draw(st.integers(1, 255))
    else:
        begin = draw(st.integers(0, len(frame) - 1))
        del frame[begin : draw(st.integers(begin + 1, len(frame)))]
    return bytes(frame)


def whole_ones(pieces, key=None):
    """How many frames the pieces hold undamaged when laid end to end, as two halves may do."""
    stream = b"".join(pieces)
    return sum(stream.count(frame) for frame in frames(key))


def play(rig, pieces):
    for piece in pieces:
        rig.wire.port.write(piece)
        rig.run(0.01)
    rig.run(0.05)


@given(st.lists(NOISE, max_size=8))
def test_noise_neither_moves_a_vehicle_nor_crashes_it(pieces):
    rig = mavlink_rig()
    play(rig, pieces)
    assert all(velocity == STOP for _, velocity in rig.plant.commands)
    assert (rig.vehicle.setpoints, rig.vehicle.requests) == (0, [])
    # A frame that noise has begun swallows what follows, up to its length; after that all is well.
    rig.wire.port.write(bytes(300))
    with rig.transport:
        rig.drive(FORWARD)
        assert rig.plant.velocity_body == FORWARD


@given(st.lists(damaged(), max_size=8))
def test_damaged_frames_move_no_vehicle(pieces):
    # Its 16-bit checksum misses one in 65,536 of arbitrary damage, and none of what changes two bytes or fewer.
    rig = mavlink_rig(vehicle={"is_guided": False, "is_armed": False})
    play(rig, pieces)
    assert rig.vehicle.setpoints + len(rig.vehicle.requests) <= whole_ones(pieces)


@given(st.lists(damaged(FAKE_KEY), max_size=8), st.lists(st.sampled_from(frames()), max_size=4))
def test_damaged_or_unsigned_frames_move_no_signed_vehicle(pieces, unsigned):
    rig = mavlink_rig(vehicle={"signing_key": FAKE_KEY})
    play(rig, pieces + unsigned)
    obeyed = rig.vehicle.setpoints + len(rig.vehicle.requests) + rig.vehicle.companion_heartbeats
    assert obeyed <= whole_ones(pieces, FAKE_KEY)


@st.composite
def said_by_vehicle(draw):
    """A frame of the vehicle's with any values, any sender and perhaps damage, or mere noise."""
    codec = MavlinkCodec(draw(st.sampled_from([1, 1, 2])), draw(st.sampled_from([1, 1, 154])))
    single = st.floats(width=32)
    byte = st.integers(0, 255)
    messages = codec.messages
    message = draw(
        st.one_of(
            st.builds(messages.MAVLink_heartbeat_message, byte, byte, byte, st.integers(0, 2**32 - 1), byte, byte),
            st.builds(messages.MAVLink_attitude_message, st.integers(0, 2**32 - 1), *[single] * 6),
            st.builds(messages.MAVLink_local_position_ned_message, st.integers(0, 2**32 - 1), *[single] * 6),
            st.builds(messages.MAVLink_command_ack_message, st.integers(0, 65535), byte),
            st.builds(messages.MAVLink_statustext_message, byte, st.binary(max_size=50)),
        )
    )
    frame = bytearray(codec.encode(message))
    if draw(st.booleans()):
        frame[draw(st.integers(0, len(frame) - 1))] ^= draw(st.integers(0, 255))
    return draw(st.sampled_from([bytes(frame), draw(st.binary(max_size=60))]))


@given(st.lists(said_by_vehicle(), max_size=12))
def test_whatever_a_vehicle_says_a_taken_one_is_not_driven(pieces):
    rig = mavlink_rig(open_timeout_s=1.5)
    with rig.transport:
        for piece in pieces:
            rig.vehicle._port.write(piece)
            rig.run(0.01)
        health = rig.transport.health()
        assert health["last_alarm"].isprintable()
        assert health["engaged"] is not health["taken_over"]
        told = rig.transport.telemetry
        assert told is None or all(abs(value) < float("inf") for value in (*told.position_xy_m, told.heading_rad))
        written = len(rig.wire.frames)
        if health["taken_over"]:
            rig.transport.stop()
            assert len(rig.wire.frames) == written
        else:
            rig.transport.send(FORWARD)


@given(st.lists(NOISE, max_size=20))
def test_a_reader_keeps_no_more_than_one_frame_begun(pieces):
    codec = MavlinkCodec(1, 1)
    for piece in pieces:
        codec.decode(piece)
        assert len(codec._decoder.buf) <= 10 + 255 + 2 + 13
