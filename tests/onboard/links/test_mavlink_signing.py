import pytest

from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import companion_heartbeat
from mtm_onboard.links.mavlink_signing import load_signing_key, signing_timestamp
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.onboard.links.mavlink_rig import FAKE_KEY, mavlink_rig
from tests.onboard.links.mavlink_spec import read_frames

FORWARD = BodyVelocity(0.5, 0.0, 0.0)
OTHER_KEY = b"another secret that is not real!"
MINUTE = 60 * 100_000


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "signing.key"
    path.touch(0o600)
    path.write_text(FAKE_KEY.hex() + "\n")
    return path


def test_a_key_file_is_64_digits_that_its_owner_alone_can_read(key_file):
    assert load_signing_key(key_file) == FAKE_KEY
    key_file.chmod(0o640)
    with pytest.raises(MtmError, match=r"can be read by others \(mode 0640\); run: chmod 600"):
        load_signing_key(key_file)


@pytest.mark.parametrize("text", ["", "00", FAKE_KEY.hex()[:-1], FAKE_KEY.hex() + "00", "z" * 64, FAKE_KEY.hex() * 9])
def test_a_file_that_is_no_key_is_refused_without_showing_it(key_file, text):
    key_file.write_text(text)
    with pytest.raises(MtmError, match="must hold 64 hexadecimal digits") as caught:
        load_signing_key(key_file)
    assert len(text) < 4 or text[:8] not in str(caught.value)


def test_a_missing_key_file_and_a_folder_are_one_sentence(tmp_path):
    with pytest.raises(MtmError, match="check the name"):
        load_signing_key(tmp_path / "missing.key")
    with pytest.raises(MtmError, match="not a file"):
        load_signing_key(tmp_path)


def test_signatures_count_ten_microseconds_since_2015():
    assert signing_timestamp(1_420_070_400.0) == 0
    assert signing_timestamp(1_420_070_460.5) == MINUTE + 50_000


def test_a_signed_link_signs_both_ways_and_drives(key_file):
    rig = mavlink_rig(vehicle={"signing_key": FAKE_KEY}, signing_key_file=str(key_file))
    with rig.transport:
        rig.drive(FORWARD)
        assert rig.plant.velocity_body == FORWARD
    assert rig.transport.health()["refused_signatures"] == rig.vehicle.refused_frames == 0
    times = [frame.signature[1] for frame in read_frames(b"".join(rig.wire.frames), FAKE_KEY)]
    assert times == sorted(set(times))


def test_a_vehicle_that_wants_signatures_ignores_others():
    rig = mavlink_rig(vehicle={"signing_key": FAKE_KEY})
    with rig.transport:
        rig.drive(FORWARD)
        assert rig.plant.velocity_body == STOP
    rig.settle()
    assert rig.vehicle.setpoints == 0
    assert rig.vehicle.refused_frames == len(rig.wire.frames)


@pytest.mark.parametrize("vehicle_key", [None, OTHER_KEY])
def test_a_vehicle_without_our_key_is_not_believed(key_file, vehicle_key):
    rig = mavlink_rig(vehicle={"signing_key": vehicle_key}, signing_key_file=str(key_file))
    with pytest.raises(MtmError, match="check the endpoint, the baud rate, the signing key and target_system"):
        rig.transport.open()
    assert rig.transport.health()["refused_signatures"] > 100
    assert rig.vehicle.setpoints == 0


def test_recorded_frames_are_refused_when_they_are_played_again(key_file):
    rig = mavlink_rig(vehicle={"signing_key": FAKE_KEY}, signing_key_file=str(key_file))
    with rig.transport:
        rig.drive(FORWARD)
    rig.settle()
    obeyed, refused = rig.vehicle.setpoints, rig.vehicle.refused_frames
    for frame in rig.wire.frames:
        rig.wire.port.write(frame)
    rig.run(0.5)
    assert rig.vehicle.setpoints == obeyed
    assert rig.vehicle.refused_frames == refused + len(rig.wire.frames)
    assert rig.plant.velocity_body == STOP


def pair(receiver_now, sender_now):
    return MavlinkCodec(1, 1, FAKE_KEY, lambda: receiver_now), MavlinkCodec(1, 191, FAKE_KEY, lambda: sender_now)


@pytest.mark.parametrize(("behind", "heard"), [(0, 1), (MINUTE - 1, 1), (MINUTE + 1, 0)])
def test_a_new_stream_may_be_a_minute_behind_and_no_more(behind, heard):
    receiver, sender = pair(10 * MINUTE, 10 * MINUTE - behind)
    assert len(receiver.decode(sender.encode(companion_heartbeat(sender.messages)))) == heard
    assert receiver.refused_signatures == 1 - heard


def test_a_forged_frame_from_the_future_shuts_no_sender_out():
    receiver, sender = pair(1000, 1000)
    first, second = (sender.encode(companion_heartbeat(sender.messages)) for _ in range(2))
    assert len(receiver.decode(first)) == 1
    forged = second[:-12] + b"\xff" * 6 + bytes(6)
    assert receiver.decode(forged) == []
    assert receiver.refused_signatures == 1
    assert len(receiver.decode(second)) == 1


def test_the_link_shows_its_key_nowhere(key_file, caplog):
    caplog.set_level(0)
    rig = mavlink_rig(vehicle={"signing_key": OTHER_KEY}, signing_key_file=str(key_file), open_timeout_s=1.5)
    with pytest.raises(MtmError) as caught:
        rig.transport.open()
    transport = rig.transport
    shown = (
        str(caught.value),
        caplog.text,
        repr(vars(transport)),
        repr(vars(transport._codec)),
        str(transport.health()),
    )
    assert caplog.text
    for text in shown:
        assert FAKE_KEY.hex() not in text
        assert FAKE_KEY.decode() not in text
