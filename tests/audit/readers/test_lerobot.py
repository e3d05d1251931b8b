"""LeRobot's tables: episodes, joints, and times that nobody measured."""

import numpy as np
import pytest

from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import read_log
from mtm_onboard.protocol import MtmError
from tests.audit.readers.log_writers import write_lerobot
from tests.audit.readers.moving_pose import driving

pytestmark = pytest.mark.long
pytest.importorskip("pyarrow")

POSE, OTHER = driving("robot0"), driving("robot1", place_m=(2.0, 1.0))


def test_episodes_are_chosen_by_number(tmp_path):
    path = write_lerobot(tmp_path, POSE, OTHER)
    with pytest.raises(MtmError, match="--topic: episode_0, episode_1"):
        read_log(path)
    warnings = []
    (track,) = read_log(path, ReadOptions(topics=("episode_1",)), warnings.append).tracks
    assert np.abs(track.positions - OTHER.positions_m[:, :2]).max() < 1e-6
    assert track.headings_rad == pytest.approx(OTHER.headings_rad, abs=1e-6)
    assert ["nominal rate" in warning for warning in warnings] == [True]


def test_joints_are_axes_of_a_track(tmp_path):
    (track,) = read_log(write_lerobot(tmp_path, POSE, names=("shoulder", "elbow", "wrist"))).tracks
    assert (track.axes, track.unit) == (("shoulder", "elbow", "wrist"), "rad")


def test_a_table_of_something_else_says_what_it_lacks(tmp_path):
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"price": [1.0]}), tmp_path / "prices.parquet")
    with pytest.raises(MtmError, match="without the column 'observation.state'"):
        read_log(tmp_path / "prices.parquet")
