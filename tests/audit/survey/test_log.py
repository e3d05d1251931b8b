import numpy as np
import pytest

from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.survey.log import survey_log
from mtm_onboard.protocol import MtmError
from tests.audit.logs_to_look_at import several_poses, table
from tests.audit.readers.log_writers import write_rosbag2
from tests.audit.readers.moving_pose import driving


def test_a_table_is_told_with_its_gap_and_without_headings(tmp_path):
    rows = [(0.1 * number, 0.01 * number, 0.0) for number in range(50) if not 20 <= number < 25]
    found = survey_log(table(tmp_path / "robot0.csv", rows))
    (body,) = found.bodies
    assert found.format == "table with a header"
    assert (body.name, body.unit, body.axes, body.headings) == ("robot0", "m", ("x", "y"), 0.0)
    assert (body.timeline.count, body.timeline.gaps, body.timeline.missing) == (45, 1, 5)
    assert body.timeline.rate_hz == pytest.approx(10.0)
    assert body.travel == pytest.approx(0.49)


def test_headings_are_counted(tmp_path):
    rows = [(0.1 * number, 0.01 * number, 0.0, 0.1 if number % 2 else "") for number in range(50)]
    (body,) = survey_log(table(tmp_path / "robot0.csv", rows, "time,x,y,yaw")).bodies
    assert body.headings == pytest.approx(0.5)


def test_a_bag_with_several_poses_lists_what_each_holds(tmp_path):
    bag = write_rosbag2(tmp_path, driving("left"), driving("right"), kind="nav_msgs/msg/Odometry")
    whole = survey_log(bag)
    assert {body.name for body in whole.bodies} == {"left", "right"}
    assert all((body.headings, body.heading_axis) == (1.0, "x") for body in whole.bodies)
    assert whole.format == "ROS 2 bag"


def test_topics_that_must_be_chosen_are_listed_and_read(tmp_path):
    bag = several_poses(tmp_path / "bag")
    found = survey_log(bag)
    assert found.bodies == ()
    assert [topic.name for topic in found.topics] == ["/odom", "/pose", "/tf:odom.base"]
    assert [len(topic.bodies) for topic in found.topics] == [1, 1, 1]
    assert found.topics[0].bodies[0].timeline.rate_hz == pytest.approx(100.0, rel=0.01)
    (body,) = survey_log(bag, ReadOptions(topics=("/pose",))).bodies
    assert body.headings == 1.0


def test_what_cannot_be_read_says_why(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing but words\nin two lines\n")
    with pytest.raises(MtmError, match="notes"):
        survey_log(tmp_path / "notes.txt")


def test_only_words_in_one_line_come_out_of_a_file(tmp_path):
    rows = [(0.1 * number, 0.0, 0.0) for number in range(20)]
    (body,) = survey_log(table(tmp_path / "a\x1b[31m.csv", rows)).bodies
    assert "\x1b" not in body.name
    assert np.isfinite(body.travel)
