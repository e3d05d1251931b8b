"""How much faster than real time logs are read, on one core: processor time, whatever else runs."""

import os

import pytest

from mtm_audit.readers.logs.registry import read_log
from tests.audit.readers.log_writers import (
    write_c3d,
    write_dataflash,
    write_rosbag1,
    write_rosbag2,
    write_tlog,
    write_ulog,
)
from tests.audit.readers.moving_pose import driving
from tests.audit.readers.text_writers import write_motive, write_tum


def processor_s():
    """Of this process and of those that it waited for: a library may run in one of its own."""
    return sum(os.times()[:4])


pytestmark = pytest.mark.benchmark(timer=processor_s)
SECONDS = 60.0
LEAST_TIMES = 50.0


def write_mcap(folder, *poses):
    return write_rosbag2(folder, *poses, mcap=True)


@pytest.mark.parametrize(
    ("write", "robots"),
    [
        (write_rosbag1, 2), (write_rosbag2, 2), (write_mcap, 2), (write_ulog, 1), (write_dataflash, 1), (write_tlog, 2),
        (write_c3d, 2), (write_motive, 2), (write_tum, 1),
    ],
    ids=["rosbag1", "rosbag2 sqlite3", "rosbag2 mcap", "ulog", "dataflash", "tlog", "c3d", "motive", "tum"],
)  # fmt: skip
def test_a_log_is_read_in_a_fiftieth_of_its_length(tmp_path, benchmark, write, robots):
    poses = [driving(f"robot{number}", SECONDS, place_m=(2.0 * number, 0.0)) for number in range(robots)]
    path = write(tmp_path, *poses)
    contents = benchmark.pedantic(read_log, args=(path,), rounds=3)
    assert [len(track.times_s) for track in contents.tracks] == [len(pose.times_s) for pose in poses]
    if benchmark.enabled:
        ratio = SECONDS / benchmark.stats.stats.min
        benchmark.extra_info["times_real_time"] = round(ratio, 1)
        print(f"\n{path.name}: {ratio:.0f} times real time, {robots} robots at 100 Hz")
        assert ratio >= LEAST_TIMES
