"""Small logs for `mtm-audit look`."""

from tests.audit.readers.every_format import STAMPED, TF
from tests.audit.readers.log_writers import ODOMETRY
from tests.audit.readers.moving_pose import driving
from tests.audit.readers.test_robot_logs import moved, posed, write_bag


def table(path, rows, header="time,x,y"):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def several_poses(path):
    """A bag with two topics of poses and one of transforms."""
    pose = driving("robot0")
    kind = STAMPED.format("Pose")
    topics = [("/odom", ODOMETRY, posed(pose, ODOMETRY)), ("/pose", kind, posed(pose, kind))]
    return write_bag(path, *topics, ("/tf", TF, moved(pose, "odom", "base")))
