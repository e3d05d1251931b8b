"""Exports of motion-capture systems: several bodies, gaps, units, axes, and when the capture began."""

import signal
import struct
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest

from mtm_audit.readers.logs.columns import header_columns
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.readers.logs.rigid import grouped
from mtm_onboard.protocol import MtmError
from tests.audit.readers.log_writers import CORNERS_M, write_c3d
from tests.audit.readers.moving_pose import driving
from tests.audit.readers.text_writers import (
    write_kitti,
    write_motive,
    write_nexus,
    write_qualisys,
    write_vicon,
    written,
)

FIRST, SECOND = driving("rover"), driving("drone", place_m=(2.0, 1.0))
MANY = {"motive": write_motive, "vicon": write_vicon, "qualisys": write_qualisys, "c3d": write_c3d}


def hidden(pose, first, last):
    """The pose with nothing seen from one sample to another."""
    positions_m = pose.positions_m.copy()
    positions_m[first:last] = np.nan
    return replace(pose, positions_m=positions_m)


def warned(path, **options):
    warnings = []
    return read_log(path, ReadOptions(**options), warnings.append), warnings


@pytest.mark.parametrize("name", MANY)
def test_several_bodies_of_a_file_are_several_tracks(tmp_path, name):
    tracks = read_log(MANY[name](tmp_path, FIRST, SECOND)).tracks
    assert [track.name for track in tracks] == ["rover", "drone"]
    for track, pose in zip(tracks, (FIRST, SECOND), strict=True):
        assert np.abs(track.positions - pose.positions_m[:, :2]).max() < 2e-5


@pytest.mark.parametrize("name", ["motive", "qualisys", "c3d"])
def test_what_was_not_seen_is_missing_and_not_zero(tmp_path, name):
    (track,) = read_log(MANY[name](tmp_path, hidden(FIRST, 50, 60))).tracks
    assert np.flatnonzero(~track.valid).tolist() == list(range(50, 60))
    assert np.isnan(track.positions[50:60]).all()


@pytest.mark.parametrize("name", ["motive", "qualisys"])
def test_the_start_of_a_capture_is_when_its_clock_began(tmp_path, name):
    contents, warnings = warned(MANY[name](tmp_path, FIRST))
    # No program names the zone, so it is this machine's.
    assert contents.at.unix_s == datetime(2026, 1, 31, 13, 2, 3, 500_000).timestamp()
    assert ["of no zone" in warning for warning in warnings] == [True]


@pytest.mark.parametrize("start", ["2026-01-31 01.02.03.500 DU.", "yesterday", "2026-13-41 01.02.03"])
def test_a_start_that_is_not_understood_is_none(tmp_path, start):
    contents, _ = warned(write_motive(tmp_path, FIRST, start=start))
    assert contents.at is None


def test_times_of_motive_are_frames_over_the_rate(tmp_path):
    (track,) = read_log(write_motive(tmp_path, driving(rate_hz=100.0))).tracks
    assert np.diff(track.times_s) == pytest.approx([0.01] * 300, abs=1e-9)


def test_an_export_of_motive_without_a_body_is_named_as_such(tmp_path):
    text = (
        "Format Version,1.23,Take Name,test,Export Frame Rate,360.000000,Length Units,Millimeters\n\n"
        ",Type\n,Name\n,ID\n,\nFrame,Time (Seconds)\n0,0.000000\n1,0.003000\n"
    )
    with pytest.raises(MtmError, match=r"export of Motive \(format 1.23\) without a rigid body or marker"):
        read_log(written(tmp_path / "take.csv", text))


def test_euler_angles_of_motive_are_in_the_order_named(tmp_path):
    yaws = np.linspace(-0.5, 0.5, 5)
    head = "Format Version,1.23,Export Frame Rate,100,Rotation Type,YXZ,Length Units,Meters\n\n"
    kinds = ",Type" + ",Rigid Body" * 6 + "\n,Name" + ",rover" * 6 + "\n,ID" + ",1" * 6 + "\n"
    parts = ",," + ",".join(["Rotation"] * 3 + ["Position"] * 3) + "\nFrame,Time (Seconds),Y,X,Z,X,Y,Z\n"
    # A turn to the left is one about the axis that points up, y.
    rows = [f"{i},{i / 100},{np.rad2deg(yaw)},0,0,{i / 100},0.2,0" for i, yaw in enumerate(yaws)]
    (track,) = read_log(written(tmp_path / "take.csv", head + kinds + parts + "\n".join(rows))).tracks
    assert track.headings_rad == pytest.approx(yaws)


def test_an_export_with_z_up_is_read_with_the_axis_named(tmp_path):
    path = write_motive(tmp_path, FIRST)
    sideways = read_log(path, ReadOptions(up="z")).tracks[0].positions
    assert np.ptp(sideways[:, 1]) < 1e-6


def test_the_axis_that_leads_a_body_of_motive_is_named(tmp_path):
    path = write_motive(tmp_path, FIRST)
    (usual,), (named,) = (read_log(path, ReadOptions(heading_axis=axis)).tracks for axis in (None, "z"))
    # Beside x and up is z, to the right.
    off = np.angle(np.exp(1j * (named.headings_rad - usual.headings_rad + np.pi / 2)))
    assert np.abs(off).max() < 1e-4
    assert (usual.heading_axis, named.heading_axis) == ("x", "z")


def test_a_unit_given_comes_before_that_of_the_header(tmp_path):
    (track,) = read_log(write_motive(tmp_path, FIRST), ReadOptions(unit="m")).tracks
    assert track.positions[1] == pytest.approx(1000 * FIRST.positions_m[1, :2], abs=1e-3)


def test_markers_before_a_colon_are_one_body(tmp_path):
    (track,) = read_log(write_nexus(tmp_path, FIRST, CORNERS_M)).tracks
    assert track.name == "rover"
    assert np.abs(track.positions - FIRST.positions_m[:, :2]).max() < 2e-5


def test_a_hidden_marker_moves_no_body(tmp_path):
    mask = np.zeros((301, 4), dtype=bool)
    mask[100:150, 2] = True
    mask[200:210, 1:3] = True
    (track,) = read_log(write_c3d(tmp_path, FIRST, hidden=mask)).tracks
    assert np.flatnonzero(~track.valid).tolist() == list(range(200, 210))
    seen = track.valid
    assert np.abs(track.positions[seen] - FIRST.positions_m[seen, :2]).max() < 2e-5


def test_markers_that_a_person_names_are_a_body(tmp_path):
    path = write_c3d(tmp_path, FIRST)
    group = ("rover_Marker1", "rover_Marker2", "rover_Marker3")
    (track,) = read_log(path, ReadOptions(bodies={"robot0": group})).tracks
    assert track.name == "robot0"
    assert track.headings_rad is not None
    with pytest.raises(MtmError, match="has no marker 'nose'; it has: rover_Marker1"):
        read_log(path, ReadOptions(bodies={"robot0": ("nose",)}))


def test_markers_that_bend_are_no_rigid_body(tmp_path):
    other = replace(FIRST, positions_m=0.5 * FIRST.positions_m)
    contents, warnings = warned(write_c3d(tmp_path, FIRST, other))
    (track,) = contents.tracks
    assert track.headings_rad is None
    assert np.abs(track.positions - 0.75 * FIRST.positions_m[:, :2]).max() < 2e-5
    assert ["no rigid body" in warning for warning in warnings] == [True]


def test_a_negative_residual_is_unseen_wherever_it_stands(tmp_path):
    path = write_c3d(tmp_path, FIRST)
    data = bytearray(path.read_bytes())
    start = 512 * (struct.unpack_from("<h", data, 16)[0] - 1)
    frame_bytes = 4 * 4 * len(CORNERS_M)
    # A writer that leaves an unseen marker where it was last seen.
    for marker in range(len(CORNERS_M)):
        struct.pack_into("<f", data, start + 7 * frame_bytes + 16 * marker + 12, -1.0)
    path.write_bytes(data)
    assert np.flatnonzero(~read_log(path).tracks[0].valid).tolist() == [7]


def test_a_c3d_file_as_long_as_it_can_count_is_doubted(tmp_path):
    pose = driving("rover", seconds=655.34)
    _, warnings = warned(write_c3d(tmp_path, pose, corners_m=((0.0, 0.0, 0.0),)))
    assert ["as many frames as the format can count" in warning for warning in warnings] == [True]


def test_a_screen_whose_vertical_is_y_has_y_up(tmp_path):
    import ezc3d

    path = write_c3d(tmp_path, FIRST)
    file = ezc3d.c3d(str(path))
    points = file["data"]["points"]
    file["data"]["points"] = np.stack([points[0], points[2], -points[1], points[3]])
    del file["data"]["meta_points"]
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Y"])
    file.write(str(path))
    (track,) = read_log(path).tracks
    assert np.abs(track.positions - FIRST.positions_m[:, :2]).max() < 2e-5


def test_poses_of_kitti_without_times_are_refused(tmp_path):
    path = write_kitti(tmp_path, FIRST)
    (tmp_path / "rover_times.txt").unlink()
    with pytest.raises(MtmError, match="put them beside it in a file times.txt"):
        read_log(path)
    written(tmp_path / "times.txt", "0.0\n0.1\n")
    with pytest.raises(MtmError, match="has 2 times and .* 301 poses"):
        read_log(path)


def test_an_export_of_the_devices_alone_says_so(tmp_path):
    text = "Devices\n1000\n,,Force Plate\nFrame,Sub Frame,Fx\n,,N\n1,0,0.5\n"
    with pytest.raises(MtmError, match="export of Vicon's with devices and no position"):
        read_log(written(tmp_path / "force.csv", text))


@pytest.mark.parametrize("data", ["Analog", ""])
def test_an_export_of_qualisys_without_motion_says_so(tmp_path, data):
    text = f"NO_OF_FRAMES\t1\nFREQUENCY\t100\nDATA_INCLUDED\t{data}\nMARKER_NAMES\ta\n1.0\n"
    with pytest.raises(MtmError, match="export of Qualisys"):
        read_log(written(tmp_path / "analog.tsv", text))


@pytest.mark.parametrize(
    ("label", "body"),
    [
        ("rover:left", "rover"), ("rover_Marker1", "rover"), ("rover_m3", "rover"), ("rover 12", "rover"),
        ("rover-2", "rover"), ("arm1", "arm"), ("nose", "nose"), ("12", "12"), (":x", ":x"), ("___1", "___1"),
    ],
)  # fmt: skip
def test_the_body_of_a_marker_is_in_its_label(label, body):
    assert list(grouped([label], {}, "take")) == [body]


@pytest.fixture
def alarm():
    """An end for what would try all ways to read a text, which takes days."""
    former = signal.signal(signal.SIGVTALRM, lambda *_: pytest.fail("a minute of work on one label"))
    signal.setitimer(signal.ITIMER_VIRTUAL, 60.0)
    yield
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    signal.signal(signal.SIGVTALRM, former)


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("letter", ["_", "1", "m", " ", ":", "1a"])
def test_a_long_label_comes_to_an_end(letter):
    assert len(grouped([letter * 20_000, letter * 20_000 + "1"], {}, "take")) >= 1
    header = header_columns("time," + "(" * 20_000 + letter * 20_000 + "," + " " * 20_000 + "x")
    assert [header[0].name, header[-1].name] == ["time", "x"]
