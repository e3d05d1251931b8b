"""All writers by the name of what they write, with the options that reading it takes."""

from functools import partial

from tests.audit.readers import log_writers as logs
from tests.audit.readers import text_writers as text

TF = "tf2_msgs/msg/TFMessage"
STAMPED = "geometry_msgs/msg/{}Stamped"

TEXT = {
    "tum": text.write_tum,
    "csv": text.write_csv,
    "german csv": text.write_german_csv,
    "euroc": text.write_euroc,
    "kitti": text.write_kitti,
    "mrclam": text.write_mrclam,
    "rostopic": text.write_rostopic,
    "crazyflie": text.write_crazyflie,
    "motive 1.23": text.write_motive,
    "motive 1.21": partial(text.write_motive, version="1.21", unit="Meters", start="2026-01-31 13.02.03"),
    "vicon tracker": text.write_vicon,
    "vicon nexus": partial(text.write_nexus, corners_m=logs.CORNERS_M),
    "qualisys 6d": text.write_qualisys,
    "qualisys 3d": partial(text.write_qualisys_markers, corners_m=logs.CORNERS_M),
}
LOGS = {
    "c3d": logs.write_c3d,
    "ulog": logs.write_ulog,
    "dataflash": logs.write_dataflash,
    "tlog": logs.write_tlog,
    "crazyflie card": logs.write_card,
    "crazyflie card of version 1": partial(logs.write_card, version=1),
    "rosbag1": logs.write_rosbag1,
    "rosbag2 sqlite3": partial(logs.write_rosbag2, kind=STAMPED.format("Pose")),
    "rosbag2 mcap": partial(logs.write_rosbag2, kind=STAMPED.format("Transform"), mcap=True),
    "rosbag2 tf": partial(logs.write_rosbag2, kind=TF),
    "rosbag2 path": partial(logs.write_rosbag2, kind="nav_msgs/msg/Path"),
    "foxglove protobuf": logs.write_foxglove,
    "foxglove json": partial(logs.write_foxglove, encoding="json"),
}
ALL = {**TEXT, **LOGS}
# Read without a library made for them.
OURS = (*TEXT, "crazyflie card", "crazyflie card of version 1")
# Headings of markers count from the frame in their middle.
FROM_MARKERS = ("c3d", "vicon nexus", "qualisys 3d")
