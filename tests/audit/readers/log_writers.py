"""Poses as logs: by the libraries that read them, or byte by byte where those cannot write."""

import json
import struct
import zlib

import numpy as np

from tests.audit.readers.moving_pose import UNIX_S
from tests.audit.readers.text_writers import markers_m, nanoseconds

BOOT_US = 81_000_000
# Of four markers, whose centre is above the body's own.
CORNERS_M = ((0.1, 0.05, 0.0), (-0.08, 0.06, 0.01), (-0.07, -0.09, 0.0), (0.05, -0.02, 0.06))
GPS_WEEK, GPS_LEAP_S = 2288, 18


def write_c3d(folder, *poses, corners_m=CORNERS_M, rate_hz=100.0, hidden=None):
    """Markers in millimetres; `hidden` is a NaN mask (n, markers) of the first body."""
    import ezc3d

    name = poses[0].name if len(poses) == 1 else "take"
    file = ezc3d.c3d()
    places = [markers_m(pose, corners_m) for pose in poses]
    if hidden is not None:
        places[0] = np.where(hidden[:, :, None], np.nan, places[0])
    points = np.ones((4, len(poses) * len(corners_m), len(poses[0].times_s)))
    points[:3] = 1000 * np.moveaxis(np.concatenate(places, axis=1), 2, 0).swapaxes(1, 2)
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [rate_hz], ["mm"]
    point["LABELS"]["value"] = [f"{pose.name}_Marker{n + 1}" for pose in poses for n in range(len(corners_m))]
    file["data"]["points"] = points
    path = folder / f"{name}.c3d"
    file.write(str(path))
    return path


LETTERS = {"uint64_t": "Q", "float": "f", "bool": "?", "uint8_t": "B", "float[4]": "4f"}


class UlogWriter:
    """A PX4 log: formats, subscriptions and data, as its own logger writes them."""

    def __init__(self):
        self._data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", BOOT_US) + self._message("B", bytes(40))
        self._formats, self._ids = {}, {}

    def define(self, name, fields):
        """`fields` are pairs of type and name; the first must be the time stamp."""
        self._formats[name] = "<" + "".join(LETTERS[kind] for kind, _ in fields)
        text = f"{name}:" + "".join(f"{kind} {field};" for kind, field in fields)
        self._data += self._message("F", text.encode())

    def subscribe(self, name, instance=0):
        self._ids[name, instance] = len(self._ids)
        self._data += self._message("A", struct.pack("<BH", instance, self._ids[name, instance]) + name.encode())

    def log(self, name, *values, instance=0):
        row = struct.pack(self._formats[name], *values)
        self._data += self._message("D", struct.pack("<H", self._ids[name, instance]) + row)

    def write(self, path):
        path.write_bytes(self._data)
        return path

    @staticmethod
    def _message(kind, content):
        return struct.pack("<Hc", len(content), kind.encode()) + content


LOCAL = (
    ("uint64_t", "timestamp"), ("uint64_t", "timestamp_sample"), ("float", "x"), ("float", "y"), ("float", "z"),
    ("float", "heading"), ("bool", "xy_valid"),
)  # fmt: skip


def write_ulog(folder, pose, gps_late_us=0, instances=1, valid=None, attitude=False):
    """North is the pose's x, west its y; messages are published 4 ms after what they say, and a GPS fix comes late."""
    log = UlogWriter()
    log.define("vehicle_local_position", LOCAL)
    log.define("sensor_gps", (("uint64_t", "timestamp"), ("uint64_t", "time_utc_usec")))
    log.define("vehicle_attitude", (("uint64_t", "timestamp"), ("float[4]", "q")))
    for instance in range(instances):
        log.subscribe("vehicle_local_position", instance)
    log.subscribe("sensor_gps")
    if attitude:
        log.subscribe("vehicle_attitude")
    for index, ((time_s, (x, y, z), _), yaw) in enumerate(zip(pose.rows(), pose.headings_rad, strict=True)):
        at_us = BOOT_US + round(time_s * 1e6)
        known = valid is None or bool(valid[index])
        for instance in range(instances):
            log.log("vehicle_local_position", at_us + 4000, at_us, x, -y, -z, wrap(-yaw), known, instance=instance)
        if attitude:
            log.log("vehicle_attitude", at_us, np.cos(-yaw / 2), 0.0, 0.0, np.sin(-yaw / 2))
        if index % 20 == 10:
            # Without a fix yet, then late once, then right.
            utc_us = 0 if index == 10 else round(UNIX_S * 1e6) + round(time_s * 1e6)
            log.log("sensor_gps", at_us + (gps_late_us if index == 30 else 0), utc_us)
    return log.write(folder / f"{pose.name}.ulg")


def write_dataflash(folder, pose, late_us=0, cores=1):
    """An ArduPilot log: XKF1 at the pose's rate and GPS at a twentieth of it, whose first record comes `late_us`."""
    head = b"\xa3\x95"

    def form(kind, name, letters, columns, length):
        fields = struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode())
        return head + b"\x80" + fields

    data = form(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89)
    data += form(10, "XKF1", "QBffff", "TimeUS,C,PN,PE,PD,Yaw", 3 + 25)
    data += form(11, "GPS", "QBIH", "TimeUS,Status,GMS,GWk", 3 + 15)
    week_s = UNIX_S - 315_964_800 + GPS_LEAP_S - GPS_WEEK * 604_800
    for index, ((time_s, (x, y, z), _), yaw) in enumerate(zip(pose.rows(), pose.headings_rad, strict=True)):
        at_us = BOOT_US + round(time_s * 1e6)
        for core in range(cores):
            numbers = (x + core, -y, -z, np.rad2deg(wrap(-yaw)) % 360)
            data += head + b"\x0a" + struct.pack("<QBffff", at_us, core, *numbers)
        if index % 20 == 10:
            logged_us = at_us + (late_us if index == 10 else 0)
            data += head + b"\x0b" + struct.pack("<QBIH", logged_us, 3, round(1000 * (week_s + time_s)), GPS_WEEK)
    path = folder / f"{pose.name}.BIN"
    path.write_bytes(data)
    return path


def write_tlog(folder, *poses, odometry=False):
    """A ground station's log that begins in MAVLink 1 and goes on in version 2, as a link that changes to it."""
    from pymavlink.dialects.v10 import common as one
    from pymavlink.dialects.v20 import common as two

    name = poses[0].name if len(poses) == 1 else "take"
    packets = []
    for number, pose in enumerate(poses, 1):
        old, new = one.MAVLink(None, number, 1), two.MAVLink(None, number, 1)
        for index, ((time_s, (x, y, z), _), yaw) in enumerate(zip(pose.rows(), pose.headings_rad, strict=True)):
            boot_ms = round((BOOT_US * 1e-6 + time_s) * 1000)
            arrival_us = round((UNIX_S + time_s + 0.02 + 0.003 * ((5 * index) % 7)) * 1e6)
            sender, dialect = (old, one) if index < 50 else (new, two)
            yaw = wrap(-yaw)
            if odometry and index >= 50:
                turn = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
                zeros = [0.0] * 21
                message = two.MAVLink_odometry_message(
                    boot_ms * 1000, 1, 12, x, -y, -z, turn, 0, 0, 0, 0, 0, 0, zeros, zeros, 0, 1, 77
                )
                packets.append((arrival_us, message.pack(new)))
            elif not odometry:
                message = dialect.MAVLink_local_position_ned_message(boot_ms, x, -y, -z, 0, 0, 0)
                packets.append((arrival_us, message.pack(sender)))
                message = dialect.MAVLink_attitude_message(boot_ms, 0, 0, yaw, 0, 0, 0)
                packets.append((arrival_us, message.pack(sender)))
            if index % 50 == 0:
                message = dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3)
                packets.append((arrival_us, message.pack(sender)))
    packets.sort(key=lambda packet: packet[0])
    path = folder / f"{name}.tlog"
    path.write_bytes(b"".join(struct.pack(">Q", at_us) + packet for at_us, packet in packets))
    return path


CARD_VARIABLES = ("stateEstimate.x(f)", "stateEstimate.y(f)", "stateEstimate.z(f)", "stateEstimate.yaw(f)")


def write_card(folder, pose, version=2, variables=CARD_VARIABLES):
    """What a Crazyflie writes to its memory card: one event, and another without variables now and then."""
    data = struct.pack("<BHH", 0xBC, version, 2) + struct.pack("<H", 7) + b"fixedFrequency\0"
    data += struct.pack("<H", len(variables)) + b"".join(name.encode() + b"\0" for name in variables)
    data += struct.pack("<H", 9) + b"estTDOA\0" + struct.pack("<H", 0)
    for index, ((time_s, place, _), yaw) in enumerate(zip(pose.rows(), pose.headings_rad, strict=True)):
        stamp = struct.pack("<Q", round(1e6 * time_s)) if version == 2 else struct.pack("<I", round(1e3 * time_s))
        data += struct.pack("<H", 7) + stamp + struct.pack("<4f", *place, np.rad2deg(wrap(yaw)))
        if index % 5 == 0:
            data += struct.pack("<H", 9) + stamp
    path = folder / f"{pose.name}.log"
    path.write_bytes(data + struct.pack("<I", zlib.crc32(data)))
    return path


def late_ns(index):
    """How much later than its stamp a message arrives."""
    return 2_000_000 + 3_000_000 * ((7 * index) % 5)


class RosMessages:
    """Messages of ROS 1 or 2 with the pose's stamps."""

    def __init__(self, store):
        self._store, types = store, store.types
        self._time, self._header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
        self._types = types

    def header(self, stamp_ns, frame="odom"):
        extra = {"seq": 0} if "seq" in self._header.__dataclass_fields__ else {}
        return self._header(stamp=self._time(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9), frame_id=frame, **extra)

    def of(self, name, *arguments, **fields):
        return self._types[name](*arguments, **fields)

    def pose(self, place, turn):
        point = self.of("geometry_msgs/msg/Point", *place)
        return self.of(
            "geometry_msgs/msg/Pose", position=point, orientation=self.of("geometry_msgs/msg/Quaternion", *turn)
        )

    def transform(self, stamp_ns, place, turn, parent="odom", child="base_link"):
        vector = self.of("geometry_msgs/msg/Vector3", *place)
        inner = self.of(
            "geometry_msgs/msg/Transform", translation=vector, rotation=self.of("geometry_msgs/msg/Quaternion", *turn)
        )
        header = self.header(stamp_ns, parent)
        return self.of("geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=inner)

    def make(self, kind, stamp_ns, place, turn):
        if kind == "geometry_msgs/msg/PoseStamped":
            return self.of(kind, header=self.header(stamp_ns), pose=self.pose(place, turn))
        if kind == "geometry_msgs/msg/TransformStamped":
            return self.transform(stamp_ns, place, turn)
        if kind == "tf2_msgs/msg/TFMessage":
            return self.of(kind, transforms=[self.transform(stamp_ns, place, turn)])
        none = self.of("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
        still = self.of("geometry_msgs/msg/Twist", linear=none, angular=none)
        zeros = np.zeros(36)
        return self.of(
            kind, header=self.header(stamp_ns), child_frame_id="base_link",
            pose=self.of("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(place, turn), covariance=zeros),
            twist=self.of("geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=zeros),
        )  # fmt: skip


ODOMETRY = "nav_msgs/msg/Odometry"


def write_rosbag1(folder, *poses, kind=ODOMETRY, stamped=True):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    path = folder / f"{poses[0].name if len(poses) == 1 else 'take'}.bag"
    with Writer(path) as writer:
        _fill(writer, store, poses, kind, store.serialize_ros1, stamped=stamped)
    return path


def write_rosbag2(folder, *poses, kind=ODOMETRY, mcap=False, stamped=True):
    """A folder with its description; `path` topics hold one nav_msgs/Path at the end."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    path = folder / (poses[0].name if len(poses) == 1 else "take")
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        _fill(writer, store, poses, kind, store.serialize_cdr, stamped=stamped)
    return path


def _fill(writer, store, poses, kind, serialize, *, stamped):
    make = RosMessages(store)
    topic = {"tf2_msgs/msg/TFMessage": "tf", "nav_msgs/msg/Path": "path"}.get(kind, "odom")
    names = ["/tf" if topic == "tf" else f"/{pose.name}/{topic}" for pose in poses]
    connections = {name: writer.add_connection(name, kind, typestore=store) for name in dict.fromkeys(names)}
    if topic == "path":
        for name, pose in zip(names, poses, strict=True):
            kept = [make.make("geometry_msgs/msg/PoseStamped", nanoseconds(t), p, q) for t, p, q in pose.rows()]
            for count in (len(kept) // 2, len(kept)):
                message = make.of(kind, header=make.header(0), poses=kept[:count])
                writer.write(connections[name], nanoseconds(pose.times_s[count - 1]), serialize(message, kind))
        return
    # In the order of time, as a recorder does.
    rows = [
        (row, name, index) for name, pose in zip(names, poses, strict=True) for index, row in enumerate(pose.rows())
    ]
    for (time_s, place, turn), name, index in sorted(rows, key=lambda item: item[0][0]):
        stamp_ns = nanoseconds(time_s)
        message = make.make(kind, stamp_ns if stamped else 0, place, turn)
        arrival_ns = stamp_ns + (late_ns(index) if stamped else 0)
        writer.write(connections[name], arrival_ns, serialize(message, kind))


def write_foxglove(folder, pose, encoding="protobuf"):
    """An MCAP of foxglove.PoseInFrame, in protobuf or JSON."""
    path = folder / f"{pose.name}.mcap"
    with path.open("wb") as file:
        if encoding == "protobuf":
            _foxglove_protobuf(file, pose)
        else:
            _foxglove_json(file, pose)
    return path


def _foxglove_protobuf(file, pose):
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from mcap_protobuf.writer import Writer

    with Writer(file, chunk_size=65_536) as writer:
        for index, (time_s, place, turn) in enumerate(pose.rows()):
            message, stamp_ns = PoseInFrame(frame_id="map"), nanoseconds(time_s)
            message.timestamp.FromNanoseconds(stamp_ns)
            for value, numbers in ((message.pose.position, place), (message.pose.orientation, turn)):
                for axis, number in zip("xyzw", numbers, strict=False):
                    setattr(value, axis, number)
            writer.write_message("/pose", message, stamp_ns + late_ns(index), stamp_ns)


def _foxglove_json(file, pose):
    from mcap.writer import Writer

    writer = Writer(file)
    writer.start("", "tests")
    schema = writer.register_schema("foxglove.PoseInFrame", "jsonschema", b'{"type": "object"}')
    channel = writer.register_channel("/pose", "json", schema)
    for index, (time_s, place, turn) in enumerate(pose.rows()):
        stamp_ns = nanoseconds(time_s)
        place_and_turn = {
            "position": dict(zip("xyz", place, strict=True)),
            "orientation": dict(zip("xyzw", turn, strict=True)),
        }
        stamp = {"sec": stamp_ns // 10**9, "nsec": stamp_ns % 10**9}
        message = {"timestamp": stamp, "frame_id": "map", "pose": place_and_turn}
        writer.add_message(channel, stamp_ns + late_ns(index), json.dumps(message).encode(), stamp_ns)
    writer.finish()


def write_lerobot(folder, *poses, names=("x", "y", "theta")):
    """A table of episodes, the names of its state in the data set's description."""
    import pyarrow
    from pyarrow import parquet

    (folder / "meta").mkdir(exist_ok=True)
    features = {"observation.state": {"dtype": "float32", "shape": [3], "names": {"motors": list(names)}}}
    (folder / "meta" / "info.json").write_text(json.dumps({"fps": 100, "features": features}))
    rows = [
        (number, np.float32(time_s), [place[0], place[1], yaw])
        for number, pose in enumerate(poses)
        for (time_s, place, _), yaw in zip(pose.rows(), pose.headings_rad, strict=True)
    ]
    episodes, times_s, states = zip(*rows, strict=True)
    table = pyarrow.table({
        "episode_index": pyarrow.array(episodes, pyarrow.int64()),
        "timestamp": pyarrow.array(times_s, pyarrow.float32()),
        "observation.state": pyarrow.array(states, pyarrow.list_(pyarrow.float32())),
    })  # fmt: skip
    path = folder / f"{poses[0].name}.parquet"
    parquet.write_table(table, path)
    return path


def wrap(angle_rad):
    return float(np.angle(np.exp(1j * angle_rad)))
