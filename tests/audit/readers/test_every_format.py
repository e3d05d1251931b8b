"""What is written in any format is read as the same motion, and decodes to the same message."""

import numpy as np
import pytest

import mtm_audit
from mtm_audit.readers.logs.opening import opening_of
from mtm_audit.readers.logs.registry import format_of, read_log
from mtm_onboard.protocol.slots import slot_at, slot_start_unix_s
from tests.audit.moving_robot import key_of, robot_track, scheme_of
from tests.audit.readers.every_format import ALL, FROM_MARKERS
from tests.audit.readers.moving_pose import UNIX_S, driving, pose_of

# What single precision and a few digits leave.
CLOSE_M = 2e-5


def turned(headings, reference):
    """Headings beside those of a reference, whatever constant lies between."""
    off = np.angle(np.exp(1j * (headings - reference)))
    return np.abs(off - np.median(off)).max()


@pytest.mark.parametrize("name", ALL)
def test_the_motion_that_was_written_is_read(tmp_path, name):
    pose = driving()
    path = ALL[name](tmp_path, pose)
    (track,) = read_log(path).tracks
    assert track.name == pose.name
    assert track.valid.all()
    moved = track.positions - track.positions[0]
    written = pose.positions_m[:, :2] - pose.positions_m[0, :2]
    if name == "kitti":
        # Ahead of its camera is where the body's x axis pointed.
        assert np.abs(moved - np.column_stack([-written[:, 1], written[:, 0]])).max() < CLOSE_M
    else:
        assert np.abs(moved - written).max() < CLOSE_M
    assert track.times_s - track.times_s[0] == pytest.approx(pose.times_s, abs=1.1e-3)
    assert turned(track.headings_rad, pose.headings_rad) < 1e-3


@pytest.mark.parametrize("name", [name for name in ALL if name not in (*FROM_MARKERS, "kitti")])
def test_headings_are_those_of_the_frame_of_the_positions(tmp_path, name):
    (track,) = read_log(ALL[name](tmp_path, driving())).tracks
    off = np.angle(np.exp(1j * (track.headings_rad - driving().headings_rad)))
    assert np.abs(off).max() < 1e-3


@pytest.mark.parametrize("name", ALL)
def test_each_format_is_recognised_as_one(tmp_path, name):
    assert format_of(opening_of(ALL[name](tmp_path, driving(seconds=1.0)))) is not None


@pytest.fixture(scope="module")
def message(tmp_path_factory):
    """A key, a robot that says 3, and what a TUM file of it decodes to."""
    key = key_of(scheme_of(symbols=(1,), ticks=400))
    pose = pose_of(robot_track(key, "robot0", (3,), 18.0, onset_s=1.0))
    path = ALL["tum"](tmp_path_factory.mktemp("tum"), pose)
    return key, pose, mtm_audit.decode(path, key)


@pytest.mark.parametrize("name", ALL)
def test_a_message_decodes_alike_from_every_format(tmp_path, message, name):
    key, pose, reference = message
    assert (reference.verdict, reference.symbols) == ("decoded", (3,))
    decoding = mtm_audit.decode(ALL[name](tmp_path, pose), key)
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3,))
    assert decoding.evidence.nats == pytest.approx(reference.evidence.nats, rel=0.02)


@pytest.fixture(scope="module")
def rolling():
    """A key whose waveforms change with time, and a robot that says 3 in the slot that begins the recording."""
    key = key_of(scheme_of(symbols=(1,), ticks=400, schedule="rolling"))
    first = slot_at(UNIX_S, key.scheme)
    assert slot_start_unix_s(first, key.scheme) == UNIX_S
    return key, pose_of(robot_track(key, "robot0", (3,), 25.0, onset_s=0.0, first_slot=first))


@pytest.mark.parametrize(
    "name", ["euroc", "mrclam", "rostopic", "ulog", "dataflash", "tlog", "rosbag1", "rosbag2 mcap"]
)
def test_a_log_that_knows_its_hour_needs_no_other(tmp_path, rolling, name):
    key, pose = rolling
    decoding = mtm_audit.decode(ALL[name](tmp_path, pose), key)
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3,))
