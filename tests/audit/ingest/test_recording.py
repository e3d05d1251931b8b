"""Which files a recording has, and several of them on one clock."""

import numpy as np
import pytest

import mtm_audit
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_onboard.protocol import MtmError
from tests.audit.readers.log_writers import write_rosbag2, write_ulog
from tests.audit.readers.moving_pose import UNIX_S, driving
from tests.audit.readers.text_writers import write_csv, write_mrclam, write_tum, written

POSE, OTHER = driving("robot0"), driving("robot1", place_m=(2.0, 1.0))


def names(paths, warn=None):
    return [path.name for path in recording_files(paths, warn)[0]]


def test_a_folder_is_read_for_what_it_holds(tmp_path):
    write_tum(tmp_path, POSE)
    write_csv(tmp_path, OTHER)
    written(tmp_path / "README.md", "Four robots, Friday.\n")
    written(tmp_path / "notes.txt", "x y z\n")
    written(tmp_path / "photo.jpg", "\u0000\u0001")
    written(tmp_path / "empty.csv", "")
    written(tmp_path / "prices.csv", "day,price\n1,2\n")
    (tmp_path / "more").mkdir()
    left_out = []
    assert names([tmp_path], left_out.append) == ["robot0.tum", "robot1.csv"]
    assert sorted(sentence.partition(" is of no format")[0].rpartition("/")[2] for sentence in left_out) == [
        "empty.csv", "prices.csv",
    ]  # fmt: skip


def test_a_folder_that_is_a_bag_is_one_recording(tmp_path):
    bag = write_rosbag2(tmp_path, POSE)
    assert recording_files([bag]) == ((bag,), "motion capture")
    write_tum(bag, OTHER)
    assert names([bag]) == ["robot0", "robot1.tum"]
    tracks = read_recording(*recording_files([bag])).tracks
    assert [track.name for track in tracks] == ["robot0", "robot1"]


def test_a_folder_without_a_recording_is_refused(tmp_path):
    written(tmp_path / "README.md", "Nothing here.\n")
    with pytest.raises(MtmError, match="no log or motion capture"):
        recording_files([tmp_path])


def test_logs_of_vehicles_that_started_apart_share_a_clock(tmp_path):
    first, second = write_ulog(tmp_path, POSE), write_mrclam(tmp_path, OTHER)
    recording = read_recording((first, second), "motion capture")
    assert recording.at.unix_s == pytest.approx(UNIX_S - 81.0, abs=1e-3)
    starts_s = [track.times_s[0] for track in recording.tracks]
    assert starts_s == pytest.approx([81.0, 81.0], abs=2e-3)


def test_files_of_one_body_are_refused(tmp_path):
    with pytest.raises(MtmError, match="two files are of the body 'robot0'"):
        read_recording((write_tum(tmp_path, POSE), write_csv(tmp_path, POSE)), "motion capture")


def test_options_of_logs_reach_the_reader(tmp_path):
    path = write_csv(tmp_path, POSE)
    recording = read_recording((path,), "motion capture", options=mtm_audit.ReadOptions(unit="cm", time_unit="ms"))
    assert np.allclose(recording.tracks[0].positions, 0.01 * POSE.positions_m[:, :2], atol=1e-6)
    assert recording.duration_s == pytest.approx(0.003)
