"""What `rostopic echo -p` prints: a CSV table whose header begins with %time."""

from pathlib import Path

from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.columns import Column, Columns, header_columns, read_columns
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import content_of
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

_STAMP, _ARRIVAL = "field_header_stamp", "time"
# The innermost pose of an Odometry, a PoseWithCovarianceStamped, a PoseStamped, a TransformStamped and a PointStamped.
_POSES = (
    ("field_pose_pose_position", "field_pose_pose_orientation"),
    ("field_pose_position", "field_pose_orientation"),
    ("field_transform_translation", "field_transform_rotation"),
    ("field_point", ""),
)


def recognises_rostopic(opening: Opening) -> bool:
    """Whether the header begins with %time."""
    return bool(opening.lines) and opening.lines[0].startswith("%time,")


def read_rostopic(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file; times in nanoseconds from the messages' headers, which are zero in some."""
    content = content_of(read_lines(path))
    header, rows = content[0], content[1:]
    by_name = {column.name: column for column in header_columns(header[1])}
    for position, turn in _POSES:
        x, y = by_name.get(f"{position}_x"), by_name.get(f"{position}_y")
        if x is not None and y is not None:
            time = by_name[_ARRIVAL] if options.arrival_times or _STAMP not in by_name else by_name[_STAMP]
            quaternion = tuple(by_name[f"{turn}_{a}"] for a in "xyzw" if f"{turn}_{a}" in by_name)
            columns = Columns(_in_ns(time), (x, y), by_name.get(f"{position}_z"), quaternion)
            return read_columns(path, header, rows, columns, options, warn)
    raise MtmError(f"{path} is an echo of a ROS topic without a pose; echo one of Odometry, PoseStamped or a transform")


def _in_ns(column: Column) -> Column:
    return Column(column.index, column.name, "ns")
