"""docs/formats.md names every format and option that there is."""

import re
from pathlib import Path

from mtm_audit.readers.logs.registry import FORMATS
from tests.docs.test_commands import options_of

PAGE = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
# The first cell of the row of each format, by the name that it has in the list.
ROWS = {
    "PX4 ULog": "PX4 ULog", "ArduPilot DataFlash": "ArduPilot DataFlash", "ROS 1 bag": "bag of ROS 1",
    "ROS 2 bag": "of ROS 2", "MCAP": "MCAP of other makes", "parquet": "LeRobot (parquet)",
    "MAVLink telemetry": "MAVLink telemetry", "Motive CSV": "Motive CSV", "Vicon CSV": "Vicon Tracker and Nexus CSV",
    "Qualisys TSV": "Qualisys TSV", "rostopic echo": "`rostopic echo -p`", "Crazyflie log": "Crazyflie log",
    "Crazyflie card": "Crazyflie memory card",
    "MR.CLAM ground truth": "MR.CLAM ground truth", "TUM trajectory": "TUM trajectory", "KITTI poses": "KITTI poses",
    "table with a header": "table with a header", "C3D": "C3D",
}  # fmt: skip


def test_every_format_has_a_row():
    cells = re.findall(r"^\| ([^|]+) \|", PAGE, re.MULTILINE)
    assert {item.name for item in FORMATS} == set(ROWS)
    assert [name for name, row in ROWS.items() if not any(row in cell for cell in cells)] == []


def test_every_option_of_the_page_is_one_of_decode():
    named = set(re.findall(r"`(--[a-z-]+)", PAGE))
    assert {"--topic", "--body", "--unit", "--time-unit", "--up", "--heading-axis", "--arrival-times"} <= named
    assert named - options_of("mtm-audit", ("decode",)) == set()
