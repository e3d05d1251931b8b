"""Logs of autopilots, ROS and others: which of several poses, by which clock, and of files that lost their end."""

import sqlite3
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mtm_audit.ingest.recording import read_recording
from mtm_audit.readers.formats.dataflash import _Formats
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import read_log
from mtm_onboard.protocol import MtmError
from tests.audit.readers.every_format import STAMPED, TF
from tests.audit.readers.log_writers import (
    BOOT_US,
    ODOMETRY,
    RosMessages,
    late_ns,
    write_c3d,
    write_card,
    write_dataflash,
    write_foxglove,
    write_rosbag1,
    write_rosbag2,
    write_tlog,
    write_ulog,
)
from tests.audit.readers.moving_pose import UNIX_S, driving
from tests.audit.readers.text_writers import nanoseconds

POSE, OTHER = driving("robot0"), driving("robot1", place_m=(2.0, 1.0))
BOOTED_S = UNIX_S - BOOT_US * 1e-6


def warned(path, **options):
    warnings = []
    return read_log(path, ReadOptions(**options), warnings.append), warnings


def close(track, pose):
    """Whether a track is where the pose was."""
    return bool(np.abs(track.positions - pose.positions_m[: len(track.times_s), :2]).max() < 2e-5)


# Autopilots


@pytest.mark.parametrize(("write", "late"), [(write_ulog, "gps_late_us"), (write_dataflash, "late_us")])
def test_one_late_gps_record_shifts_no_log(tmp_path, write, late):
    contents = read_log(write(tmp_path, POSE, **{late: 300_000}))
    assert contents.at.unix_s == pytest.approx(BOOTED_S, abs=2e-3)
    assert contents.at.error_s <= 1.0
    assert contents.tracks[0].times_s[0] == pytest.approx(BOOT_US * 1e-6)


def test_a_log_without_gps_time_does_not_say_when_it_was(tmp_path):
    assert read_log(write_ulog(tmp_path, driving(seconds=0.2))).at is None


def test_instances_of_an_estimator_are_chosen_by_number(tmp_path):
    contents, warnings = warned(write_ulog(tmp_path, POSE, instances=2))
    assert [track.name for track in contents.tracks] == ["robot0"]
    assert ["vehicle_local_position.1" in warning for warning in warnings] == [True]
    contents, warnings = warned(tmp_path / "robot0.ulg", topics=("vehicle_local_position.1",))
    assert [track.name for track in contents.tracks] == ["vehicle_local_position.1"]
    assert warnings == []
    path = write_dataflash(tmp_path, POSE, cores=2)
    (track,) = read_log(path, ReadOptions(topics=("XKF1.1",))).tracks
    assert track.positions[0] == pytest.approx(POSE.positions_m[0, :2] + [1.0, 0.0])


def test_what_an_autopilot_did_not_know_is_missing(tmp_path):
    valid = np.ones(301, dtype=bool)
    valid[20:30] = False
    (track,) = read_log(write_ulog(tmp_path, POSE, valid=valid)).tracks
    assert np.flatnonzero(~track.valid).tolist() == list(range(20, 30))
    with pytest.raises(MtmError, match="never valid"):
        read_log(write_ulog(tmp_path, POSE, valid=np.zeros(301, dtype=bool)))


def test_a_named_axis_is_that_of_the_vehicle_s_attitude(tmp_path):
    path = write_ulog(tmp_path, POSE, attitude=True)
    (stated,) = read_log(path).tracks
    (named,) = read_log(path, ReadOptions(heading_axis="-y")).tracks
    # The y axis of an aircraft points to its right.
    off = np.angle(np.exp(1j * (named.headings_rad - stated.headings_rad - np.pi / 2)))
    assert np.abs(off).max() < 1e-3
    assert (stated.heading_axis, named.heading_axis) == (None, "-y")
    warnings = []
    (upright,) = read_log(path, ReadOptions(heading_axis="z"), warnings.append).tracks
    assert upright.heading_axis == "x"
    assert f"{path}: the z axis of the vehicle stands upright" in warnings[0]


def test_odometry_after_a_change_of_version_is_read(tmp_path):
    (track,) = read_log(write_tlog(tmp_path, POSE, odometry=True)).tracks
    # The first fifty samples were sent in version 1, which has no such message.
    assert len(track.times_s) == 251
    assert np.abs(track.positions - POSE.positions_m[50:, :2]).max() < 2e-5
    off = np.angle(np.exp(1j * (track.headings_rad - POSE.headings_rad[50:])))
    assert np.abs(off).max() < 1e-6


def test_damage_in_a_dataflash_log_is_not_printed(tmp_path, capfd):
    path = write_dataflash(tmp_path, POSE)
    data = bytearray(path.read_bytes())
    data[5000:5200] = bytes(200)
    path.write_bytes(data)
    assert 280 <= len(read_log(path).tracks[0].times_s) < 301
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("said_bytes", [0, 1, 2])
def test_messages_shorter_than_their_head_are_refused(said_bytes):
    forms = _Formats({0x80: SimpleNamespace(name="FMT", len=89)})
    with pytest.raises(ValueError, match=f"messages ATT are said to have {said_bytes} bytes"):
        forms[10] = SimpleNamespace(name="ATT", len=said_bytes)
    forms[10] = SimpleNamespace(name="ATT", len=3)
    assert sorted(forms) == [10, 0x80]


def test_every_format_of_a_dataflash_log_is_checked(tmp_path, monkeypatch):
    checked = []
    monkeypatch.setattr(_Formats, "__setitem__", lambda self, number, form: checked.append(form.name))
    with pytest.raises(MtmError, match="without a position"):
        read_log(write_dataflash(tmp_path, POSE))
    assert {"XKF1", "GPS"} <= set(checked)


def test_each_vehicle_of_a_telemetry_log_is_a_body(tmp_path):
    contents = read_log(write_tlog(tmp_path, POSE, OTHER))
    assert [track.name for track in contents.tracks] == ["system1", "system2"]
    assert all(close(track, pose) for track, pose in zip(contents.tracks, (POSE, OTHER), strict=True))
    assert contents.at.unix_s == 0.0
    assert contents.tracks[0].times_s[0] == pytest.approx(UNIX_S, abs=0.05)


def test_times_of_telemetry_are_those_of_the_vehicle(tmp_path):
    path = write_tlog(tmp_path, POSE)
    (track,), (arrived,) = read_log(path).tracks, read_log(path, ReadOptions(arrival_times=True)).tracks
    assert np.diff(track.times_s) == pytest.approx([0.01] * 300, abs=1.1e-3)
    assert np.diff(arrived.times_s).max() > 0.012


def test_damage_in_a_telemetry_log_costs_what_is_damaged(tmp_path):
    path = write_tlog(tmp_path, POSE)
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 400] = bytes(400)
    path.write_bytes(data)
    contents, warnings = warned(path)
    assert 280 <= len(contents.tracks[0].times_s) < 301
    assert ["damaged" in warning for warning in warnings] == [True]


def test_a_log_without_a_position_says_what_to_log(tmp_path):
    path = write_tlog(tmp_path, driving("robot0", seconds=0.4), odometry=True)
    with pytest.raises(MtmError, match="without a position; let the vehicle send LOCAL_POSITION_NED"):
        read_log(path)


def test_a_card_that_was_cut_gives_what_is_whole(tmp_path):
    path = write_card(tmp_path, POSE)
    path.write_bytes(path.read_bytes()[:-1000])
    contents, warnings = warned(path)
    assert 250 < len(contents.tracks[0].times_s) < 301
    assert close(contents.tracks[0], POSE)
    assert ["was cut or damaged" in warning for warning in warnings] == [True]


def test_a_card_without_a_position_names_what_it_has(tmp_path):
    path = write_card(tmp_path, POSE, variables=("acc.x(f)", "acc.y(f)", "acc.z(f)", "pm.vbat(f)"))
    with pytest.raises(MtmError, match=r"without a position but with acc.x, acc.y, acc.z, pm.vbat"):
        read_log(path)


def test_names_from_a_file_command_no_terminal(tmp_path):
    path = write_card(tmp_path, POSE, variables=("acc\n.x(f)", "acc\x1b[2J(f)", "a(f)", "b(f)"))
    with pytest.raises(MtmError, match=r"with a, acc\?.x, acc\?\[2J, b;"):
        read_log(path)


# ROS


@pytest.mark.parametrize("write", [write_rosbag1, write_rosbag2])
def test_topics_of_several_robots_are_all_read(tmp_path, write):
    tracks = read_log(write(tmp_path, POSE, OTHER)).tracks
    assert [track.name for track in tracks] == ["robot0", "robot1"]
    assert all(close(track, pose) for track, pose in zip(tracks, (POSE, OTHER), strict=True))


@pytest.mark.parametrize("mcap", [False, True])
def test_times_are_those_of_headers_and_arrivals_if_asked(tmp_path, mcap):
    path = write_rosbag2(tmp_path, POSE, mcap=mcap)
    (track,), (arrived,) = read_log(path).tracks, read_log(path, ReadOptions(arrival_times=True)).tracks
    assert track.times_s - UNIX_S == pytest.approx(POSE.times_s, abs=1e-6)
    # Arrivals overtake each other here, and come in their own order.
    late_s = sorted(1e-9 * late_ns(index) + time_s for index, time_s in enumerate(POSE.times_s))
    assert len(arrived.times_s) == len(set(np.round(late_s, 6)))
    assert read_log(path).at.unix_s == 0.0


def test_messages_without_stamps_are_timed_by_arrival(tmp_path):
    contents, warnings = warned(write_rosbag2(tmp_path, POSE, stamped=False))
    assert contents.tracks[0].times_s - UNIX_S == pytest.approx(POSE.times_s, abs=1e-6)
    assert ["carry no time" in warning for warning in warnings] == [True]


def write_bag(path, *topics, mcap=False):
    """A bag of connections (topic, kind, [(stamp_s, message)]) made by functions of RosMessages."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    make = RosMessages(store)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3) as writer:
        for topic, kind, messages in topics:
            connection = writer.add_connection(topic, kind, typestore=store)
            for stamp_s, build in messages:
                writer.write(
                    connection, nanoseconds(stamp_s), store.serialize_cdr(build(make, nanoseconds(stamp_s)), kind)
                )
    return path


def posed(pose, kind):
    return [(t, lambda make, ns, p=p, q=q: make.make(kind, ns, p, q)) for t, p, q in pose.rows()]


def moved(pose, parent, child):
    def build(p, q):
        return lambda make, ns: make.of(TF, transforms=[make.transform(ns, p, q, parent, child)])

    return [(t, build(p, q)) for t, p, q in pose.rows()]


def test_a_choice_of_topics_is_left_to_a_person(tmp_path):
    topics = (
        ("/odom", ODOMETRY, posed(POSE, ODOMETRY)),
        ("/pose", STAMPED.format("Pose"), posed(OTHER, STAMPED.format("Pose"))),
    )
    path = write_bag(tmp_path / "bag", *topics, ("/tf", TF, moved(POSE, "odom", "base")))
    with pytest.raises(MtmError, match=r"name one or more with --topic: /odom, /pose, /tf:odom.base"):
        read_log(path)
    (track,) = read_log(path, ReadOptions(topics=("/pose",))).tracks
    assert (track.name, close(track, OTHER)) == ("bag", True)
    tracks = read_log(path, ReadOptions(topics=("/odom", "/pose", "/tf:odom.base"))).tracks
    assert [track.name for track in tracks] == ["odom", "pose", "base"]
    with pytest.raises(MtmError, match="has no /scan; it has: /odom, /pose, /tf"):
        read_log(path, ReadOptions(topics=("/scan",)))
    with pytest.raises(MtmError, match="holds many frames; name two of them: /tf:odom.base"):
        read_log(path, ReadOptions(topics=("/tf",)))


def test_a_bag_without_poses_lists_what_it_has(tmp_path):
    kind = "geometry_msgs/msg/Vector3"
    path = write_bag(tmp_path / "bag", ("/wind", kind, [(0.0, lambda make, _: make.of(kind, 1.0, 2.0, 3.0))]))
    with pytest.raises(MtmError, match=r"without a topic of poses; it has: /wind \(geometry_msgs/msg/Vector3\)"):
        read_log(path)


def still(place, turn, parent, child):
    return [(0.0, lambda make, ns: make.of(TF, transforms=[make.transform(ns, place, turn, parent, child)]))]


def test_frames_are_followed_through_what_lies_between(tmp_path):
    quarter = (0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4))
    path = write_bag(
        tmp_path / "bag",
        ("/tf", TF, moved(POSE, "odom", "base.link")),
        (
            "/tf_static",
            TF,
            still((5.0, 0.0, 0.0), quarter, "map", "odom") + still((0.1, 0.0, 0.0), (0, 0, 0, 1), "base.link", "cam"),
        ),
    )
    (track,) = read_log(path, ReadOptions(topics=("/tf:map.base.link",))).tracks
    x, y = POSE.positions_m[:, 0], POSE.positions_m[:, 1]
    assert track.positions == pytest.approx(np.column_stack([5.0 - y, x]), abs=1e-6)
    assert np.angle(np.exp(1j * (track.headings_rad - POSE.headings_rad - np.pi / 2))) == pytest.approx(0.0, abs=1e-6)
    (camera,) = read_log(path, ReadOptions(topics=("/tf:odom.cam",))).tracks
    ahead = 0.1 * np.column_stack([np.cos(POSE.headings_rad), np.sin(POSE.headings_rad)])
    assert camera.positions == pytest.approx(POSE.positions_m[:, :2] + ahead, abs=1e-6)
    with pytest.raises(MtmError, match="does not move in"):
        read_log(path, ReadOptions(topics=("/tf:map.odom",)))
    with pytest.raises(MtmError, match="no frames '/tf:map.moon'; write /tf:PARENT.CHILD with two of: base.link, cam"):
        read_log(path, ReadOptions(topics=("/tf:map.moon",)))


def test_transforms_of_different_rates_meet_in_time(tmp_path):
    coarse_s = POSE.times_s[::10]
    drift_m = np.column_stack([0.3 * coarse_s, 0.0 * coarse_s, 0.0 * coarse_s])
    coarse = replace(POSE, times_s=coarse_s, positions_m=drift_m, headings_rad=0.0 * coarse_s)
    path = write_bag(tmp_path / "bag", ("/tf", TF, moved(POSE, "odom", "base") + moved(coarse, "map", "odom")))
    (track,) = read_log(path, ReadOptions(topics=("/tf:map.base",))).tracks
    drifted = POSE.positions_m[:, :2] + np.column_stack([0.3 * POSE.times_s, 0.0 * POSE.times_s])
    assert track.positions == pytest.approx(drifted, abs=1e-6)


OWN = "my_msgs/msg/PoseStamped"


def own_messages(fields, write):
    """Messages of a definition with these fields in this order, of equal length in every order; to `write`."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    definition = "int64 stamp\n" + "".join(f"float64 {axis}\n" for axis in fields)
    store.register(get_types_from_msg(definition, OWN))
    for time_s, place, _ in POSE.rows():
        message = store.types[OWN](stamp=nanoseconds(time_s), **dict(zip("xyz", place, strict=True)))
        write(store, definition, nanoseconds(time_s), message)


def write_two_definitions_1(path, order):
    from rosbags.rosbag1 import Writer

    connections = {}
    with Writer(path.with_suffix(".bag")) as writer:
        for topic, fields in order:

            def write(store, _, at_ns, message, topic=topic):
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, OWN, typestore=store)
                writer.write(connections[topic], at_ns, store.serialize_ros1(message, OWN))

            own_messages(fields, write)
    return path.with_suffix(".bag")


def write_two_definitions_mcap(path, order):
    from mcap.writer import Writer

    channels = {}
    with path.with_suffix(".mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "tests")
        for topic, fields in order:

            def write(store, definition, at_ns, message, topic=topic):
                if topic not in channels:
                    schema = writer.register_schema(OWN, "ros2msg", definition.encode())
                    channels[topic] = writer.register_channel(topic, "cdr", schema)
                writer.add_message(channels[topic], at_ns, bytes(store.serialize_cdr(message, OWN)), at_ns)

            own_messages(fields, write)
        writer.finish()
    return path.with_suffix(".mcap")


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("write", [write_two_definitions_1, write_two_definitions_mcap])
def test_each_topic_is_read_by_its_own_definition(tmp_path, write, turned):
    order = [("/a/pose", "xyz"), ("/b/pose", "yxz")]
    tracks = read_log(write(tmp_path / "bag", order[::-1] if turned else order)).tracks
    assert sorted(track.name for track in tracks) == ["a", "b"]
    assert all(close(track, POSE) for track in tracks)


def test_each_recording_is_read_by_its_own_definition(tmp_path):
    files = [
        write_two_definitions_1(tmp_path / name, [("/pose", fields)]) for name, fields in (("a", "xyz"), ("b", "yxz"))
    ]
    for paths in (files, files[::-1]):
        recording = read_recording(tuple(paths), "motion capture")
        assert all(close(track, POSE) for track in recording.tracks)


def test_a_bag_from_before_definitions_were_kept_is_read(tmp_path):
    path = write_rosbag2(tmp_path, POSE)
    with sqlite3.connect(path / "robot0.db3") as database:
        database.execute("DELETE FROM message_definitions")
    database.close()
    assert close(read_log(path).tracks[0], POSE)


def test_a_file_of_a_bag_is_read_by_itself(tmp_path):
    path = write_rosbag2(tmp_path, POSE)
    assert close(read_log(path / "robot0.db3").tracks[0], POSE)


def test_a_bag_converted_from_ros_1_is_read(tmp_path):
    from rosbags.convert.converter import convert
    from rosbags.typesys import Stores, get_typestore

    source, target = write_rosbag1(tmp_path, POSE), tmp_path / "converted"
    convert(
        [source], target, dst_storage="sqlite3", dst_version=8, compress=None, compress_mode="none",
        default_typestore=None, typestore=get_typestore(Stores.ROS2_HUMBLE), exclude_topics=(), include_topics=(),
        exclude_msgtypes=(), include_msgtypes=(),
    )  # fmt: skip
    (track,) = read_log(target).tracks
    assert track.times_s - UNIX_S == pytest.approx(POSE.times_s, abs=1e-6)
    assert close(track, POSE)


def test_a_plan_is_no_trajectory(tmp_path):
    kind, stamped = "nav_msgs/msg/Path", STAMPED.format("Pose")
    plan = [
        (
            0.0,
            lambda make, ns: make.of(
                kind, header=make.header(ns), poses=[make.make(stamped, 0, p, q) for _, p, q in POSE.rows()]
            ),
        )
    ]
    with pytest.raises(MtmError, match="have no times of their own"):
        read_log(write_bag(tmp_path / "bag", ("/plan", kind, plan)))


# MCAP


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_a_file_that_lost_its_end_gives_what_is_whole(tmp_path, encoding):
    path = write_foxglove(tmp_path, driving("robot0", seconds=120.0), encoding)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 6 // 10])
    contents, warnings = warned(path)
    (track,) = contents.tracks
    assert 0.3 * 12_001 < len(track.times_s) < 0.65 * 12_001
    assert close(track, driving("robot0", seconds=120.0))
    assert len(warnings) == 1
    assert f"{len(track.times_s)} messages are whole" in warnings[0]


def test_a_cut_bag_of_ros_gives_what_is_whole(tmp_path):
    (path,) = write_rosbag2(tmp_path, driving("robot0", seconds=60.0), mcap=True).glob("*.mcap")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 6 // 10])
    contents, warnings = warned(path)
    assert len(contents.tracks[0].times_s) > 2000
    assert ["was cut short" in warning for warning in warnings] == [True]


def test_transforms_of_foxglove_are_followed(tmp_path):
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from mcap_protobuf.writer import Writer

    path = tmp_path / "robot0.mcap"
    with path.open("wb") as file, Writer(file) as writer:
        for time_s, place, turn in POSE.rows():
            message = FrameTransform(parent_frame_id="map", child_frame_id="robot")
            message.timestamp.FromNanoseconds(nanoseconds(time_s))
            for value, numbers in ((message.translation, place), (message.rotation, turn)):
                for axis, number in zip("xyzw", numbers, strict=False):
                    setattr(value, axis, number)
            writer.write_message("/moves", message, nanoseconds(time_s), nanoseconds(time_s))
    contents, warnings = warned(path)
    assert close(contents.tracks[0], POSE)
    assert ["robot is followed in the frame map" in warning for warning in warnings] == [True]


def test_an_encoding_that_is_not_read_is_named(tmp_path):
    from mcap.writer import Writer

    path = tmp_path / "robot0.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("", "tests")
        schema = writer.register_schema("foxglove.PoseInFrame", "flatbuffer", b"")
        channel = writer.register_channel("/pose", "flatbuffer", schema)
        writer.add_message(channel, 0, b"0000", 0)
        writer.finish()
    with pytest.raises(MtmError, match="/pose is encoded as flatbuffer, which is not read"):
        read_log(path)


# What is not installed


@pytest.mark.parametrize(
    ("write", "module", "extra"),
    [
        (write_c3d, "ezc3d", "logs"),
        (write_ulog, "pyulog", "logs"),
        (write_dataflash, "pymavlink", "logs"),
        (write_rosbag1, "rosbags", "logs"),
        (write_foxglove, "mcap", "logs"),
        (lambda folder, _: _parquet(folder), "pyarrow", "parquet"),
    ],
    ids=["c3d", "ulog", "dataflash", "rosbag", "mcap", "parquet"],
)
def test_a_library_that_is_missing_is_named(tmp_path, monkeypatch, write, module, extra):
    path = write(tmp_path, POSE)
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(
        MtmError, match=rf"needs {module}; install it with: pip install 'messages-through-motion\[{extra}\]'"
    ):
        read_log(path)


def _parquet(folder):
    path = folder / "episode.parquet"
    path.write_bytes(b"PAR1" + bytes(100))
    return path
