import math
import socket
from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.live.events import Notice, Pose
from mtm_audit.live.growing import growing_poses
from mtm_audit.live.poses import MOST_BODIES, PoseLines, PoseTracks, parse_pose, udp_poses
from mtm_audit.live.timeline import Timeline
from mtm_onboard.protocol import MtmError

NAMES = st.text("abc 0[]<>&é", min_size=1).map(str.strip).filter(bool)
NUMBERS = st.floats(-1e6, 1e6)


def told(*lines, live=False):
    return list(PoseLines(Timeline(is_live=live), "udp://127.0.0.1:1").events(lines, 0.0))


@given(NAMES, NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_a_line_gives_back_what_was_written(name, time_s, x, y, heading_rad):
    pose = parse_pose(f" {name} , {time_s!r},{x!r},{y!r},{heading_rad!r}")
    assert pose == Pose(name, time_s, x, y, heading_rad)


@given(st.text())
def test_any_text_is_a_pose_or_one_sentence(text):
    for event in told(text):
        assert isinstance(event, Pose | Notice)


@pytest.mark.parametrize(
    "line", ["robot0", "robot0,1,2", ",1,2,3", "r,nan,1,2", "r,1,x,2", "r,1,2,3,4,5", "r,1,1e10,2"]
)
def test_what_is_no_pose_is_left_out_and_told_once(line):
    events = told(line, line, "robot0,1,2,3")
    assert [type(event) for event in events] == [Notice, Pose]


def test_out_of_sight_is_missing_and_not_zero():
    (pose,) = told("robot0,1.0,nan,nan")
    gathered = PoseTracks()
    gathered.put(pose)
    (track,) = gathered.tracks()
    assert not track.valid[0]
    assert np.isnan(track.positions[0]).all()


def test_times_that_do_not_rise_are_left_out():
    events = told("r,1,0,0", "r,1,5,5", "q,1,0,0")
    assert [event.name for event in events if isinstance(event, Pose)] == ["r", "q"]


def test_no_sender_can_fill_the_memory_with_names():
    events = told(*[f"body{number},1,0,0" for number in range(2 * MOST_BODIES)])
    assert sum(isinstance(event, Pose) for event in events) == MOST_BODIES
    assert sum(isinstance(event, Notice) for event in events) == 1


def test_a_sender_that_begins_anew_goes_on_where_it_arrives():
    lines = PoseLines(Timeline(), "udp://127.0.0.1:1")
    first = list(lines.events(["r,100.0,0,0", "r,101.0,0,0"], 50.0))
    again = list(lines.events(["r,0.0,0,0", "r,0.5,0,0"], 54.0))
    assert [pose.time_s for pose in (*first, *again)] == pytest.approx([0.0, 1.0, 4.0, 4.5])


def test_what_was_forgotten_is_gone():
    gathered = PoseTracks()
    for time_s in range(10):
        gathered.put(Pose("r", float(time_s), 0.0, 0.0))
    gathered.put(Pose("q", 1.0, 0.0, 0.0))
    gathered.forget(6.0)
    (track,) = gathered.tracks()
    assert track.times_s.tolist() == [6.0, 7.0, 8.0, 9.0]


def test_poses_arrive_over_udp():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    events = udp_poses("127.0.0.1", port, f"udp://127.0.0.1:{port}")
    first = next(events)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"robot0,5.0,1.0,2.0\nrobot1,5.0,3.0,4.0,0.5\n", ("127.0.0.1", port))
    found = list(islice((event for event in events if isinstance(event, Pose)), 2))
    assert not isinstance(first, Pose)
    assert [(pose.name, pose.x) for pose in found] == [("robot0", 1.0), ("robot1", 3.0)]
    assert math.isnan(found[0].heading_rad)


def test_an_address_that_is_not_here_is_one_sentence():
    with pytest.raises(MtmError, match="cannot receive at"):
        next(udp_poses("192.0.2.1", 5005, "udp://192.0.2.1:5005"))


def test_lines_of_a_file_are_read_as_they_are_written(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("# name,time_s,x,y\nr,1.0,0,0\nr,1.1,0,")
    slept = []

    def write_more(pause_s):
        if not slept:
            with path.open("a") as file:
                file.write("5\nr,1.2,0,6")
        slept.append(pause_s)

    poses = [event for event in growing_poses(path, 1.0, write_more) if isinstance(event, Pose)]
    assert [(pose.time_s, pose.y) for pose in poses] == [(1.0, 0.0), (1.1, 5.0), (1.2, 6.0)]
    assert sum(slept) >= 1.0
