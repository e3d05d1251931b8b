"""Tables of text: TUM, headed CSV, and what programs and countries make of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.model.track import Track
from mtm_audit.readers.logs.opening import opening_of
from mtm_audit.readers.logs.options import ReadOptions, marker_groups
from mtm_audit.readers.logs.registry import format_of, read_log
from mtm_onboard.protocol import MtmError

TUM = "0 0 0 0 0 0 0 1\n"


@pytest.fixture
def write(tmp_path):
    def _write(text, name="robot0.tum"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return _write


def read(path, **options):
    """The one track of a file, and what was said of it."""
    warnings = []
    (track,) = read_log(path, ReadOptions(**options), warnings.append).tracks
    return track, warnings


def test_a_tum_file_gives_positions_and_headings(write):
    text = "# timestamp tx ty tz qx qy qz qw\n0.0 1 2 3 0 0 0 1\n\n0.5 4 5 6 0 0 0.70710678 0.70710678\n"
    track, warnings = read(write(text))
    assert (track.name, track.unit, warnings) == ("robot0", "m", [])
    assert track.times_s.tolist() == [0.0, 0.5]
    assert track.positions.tolist() == [[1, 2], [4, 5]]
    assert track.headings_rad == pytest.approx([0, np.pi / 2])


def test_the_heading_of_a_pitched_body_is_its_yaw(write):
    yaw, pitch = 0.7, 0.2
    cy, sy, cp, sp = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    line = " ".join(str(value) for value in (0, 0, 0, 0, -sy * sp, cy * sp, sy * cp, cy * cp))
    assert read(write(line))[0].headings_rad == pytest.approx([yaw])


def test_a_line_with_nan_is_an_unobserved_sample(write):
    track, _ = read(write("0 1 2 3 0 0 0 1\n1 nan nan nan nan nan nan nan\n2 1 2 3 0 0 0 1\n"))
    assert track.valid.tolist() == [True, False, True]
    assert np.isnan(track.positions[1]).all()


def test_a_repeated_time_drops_a_row_with_a_warning(write):
    track, warnings = read(write("0 1 2 0 0 0 0 1\n1 3 4 0 0 0 0 1\n1 5 6 0 0 0 0 1\n2 7 8 0 0 0 0 1\n"))
    assert track.times_s.tolist() == [0, 1, 2]
    assert track.positions[1].tolist() == [3, 4]
    assert len(warnings) == 1
    assert "1 row repeats the time of the row before and was left out" in warnings[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"{TUM}2 0 0 0 0 0 0 1\n# note\n1 0 0 0 0 0 0 1\n", "line 4.*sort the lines"),
        ("0 0 0 0 0 0 1\n", "line 1: expected 8 numbers"),
        ("0 0 0 zero 0 0 0 1\n", "line 1: expected 8 numbers"),
        ("nan 0 0 0 0 0 0 1\n", "line 1: the time is not a number"),
        (f"{TUM}0.1 1e300 0 0 0 0 0 1\n", "line 2: a position beyond 1e\\+09 m"),
        ("0 nan nan nan 0 0 0 1\n", "no position of robot0 that was observed"),
        ("# nothing\n", "holds no samples"),
        ("", "is empty"),
        (b"\x00\x01\x02", "of no format that is read"),
        ("HIERARCHY\nROOT Hips\n", "a BVH animation"),
        ("rosbag2_bagfile_information:\n  files: []\n", "the description of a bag of ROS 2"),
    ],
)
def test_a_bad_file_is_refused_with_one_sentence(write, text, says):
    with pytest.raises(MtmError, match=says):
        read(write(text))


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(MtmError, match="check the name"):
        read_log(tmp_path / "robot0.tum")
    with pytest.raises(MtmError, match="of no format"):
        read_log(tmp_path)


def test_a_csv_table_is_read_by_its_header(write):
    track, _ = read(write("time, X, y, yaw, quality\n0,1,2,0.1,9\n1,,,,9\n2,3,4,0.2,9\n", "rover.csv"))
    assert track.name == "rover"
    assert track.valid.tolist() == [True, False, True]
    assert track.positions[2].tolist() == [3, 4]
    assert track.headings_rad[0] == 0.1


def test_a_csv_table_without_yaw_has_no_headings(write):
    assert read(write("time,x,y\n0,1,2\n1,3,4\n", "rover.txt"))[0].headings_rad is None


def test_a_csv_table_that_lacks_a_column_is_refused(write):
    with pytest.raises(MtmError, match="lacks the column 'x'"):
        read(write("time,y\n0,1\n", "rover.csv"))


LINES = ["time,x,y,yaw", "0.0,1.5,-2.25,0.5", "0.1,1.75,-2.5,0.5"]


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("time,x,y,yaw", LINES[1:]),
        ("Time;X;Y;Yaw", [line.replace(",", ";") for line in LINES[1:]]),
        ("Time;X;Y;Yaw", [line.replace(",", ";").replace(".", ",") for line in LINES[1:]]),
        ("time\tx\ty\tyaw", [line.replace(",", "\t") for line in LINES[1:]]),
        ("time\tx\ty\tyaw", [line.replace(",", "\t").replace(".", ",") for line in LINES[1:]]),
        ("time x y yaw", [line.replace(",", " ") for line in LINES[1:]]),
        ("t [ms],x [mm],y [mm],heading [rad]", ["0,1500,-2250,0.5", "100,1750,-2500,0.5"]),
        ("timestamp_us,pos_x_cm,pos_y_cm,yaw", ["0,150,-225,0.5", "100000,175,-250,0.5"]),
        ("time (seconds),position.x,position.y,yaw (deg)", ["0,1.5,-2.25,28.64788976", "0.1,1.75,-2.5,28.64788976"]),
        ("# time, x, y, yaw", LINES[1:]),
        ('"time","x","y","yaw"', ['"0.0","1.5","-2.25","0.5"', '"0.1","1.75","-2.5","0.5"']),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_a_table_in_any_dress_is_the_same_table(write, header, rows, encoding):
    track, _ = read(write("\r\n".join([header, *rows, ""]).encode(encoding), "rover.csv"))
    assert track.times_s == pytest.approx([0.0, 0.1])
    assert track.positions.tolist() == pytest.approx(np.array([[1.5, -2.25], [1.75, -2.5]]))
    assert track.headings_rad == pytest.approx([0.5, 0.5])


def test_units_that_a_person_gives_come_before_the_header(write):
    path = write("time,x [mm],y [mm]\n0,1,2\n10,3,4\n", "rover.csv")
    track, _ = read(path, unit="cm", time_unit="ms")
    assert track.times_s.tolist() == [0.0, 0.01]
    assert track.positions[0].tolist() == pytest.approx([0.01, 0.02])


@pytest.mark.parametrize(
    ("first", "step", "unit"),
    [(1.7e18, 1e7, "nanoseconds"), (1.7e15, 1e4, "microseconds"), (1.7e12, 10.0, "milliseconds"), (1.7e9, 0.01, None)],
)
def test_the_size_of_unix_times_tells_their_unit(write, first, step, unit):
    rows = [f"{first + step * index:.2f},{index},0" for index in range(4)]
    path = write("\n".join(["time,x,y", *rows]), "rover.csv")
    track, warnings = read(path)
    assert track.times_s[0] == pytest.approx(1.7e9)
    assert np.diff(track.times_s) == pytest.approx([0.01] * 3, rel=1e-3)
    assert [unit in warning for warning in warnings] == ([True] if unit else [])
    assert read_log(path).at.unix_s == 0.0


def test_times_and_places_of_an_unlikely_size_are_asked_about(write):
    _, warnings = read(write("time,x,y\n0,0,0\n10,30000,0\n20,60000,0\n", "rover.csv"))
    assert ["--time-unit" in warning for warning in warnings] == [True, False]
    assert "--unit" in warnings[1]


def test_an_axis_that_points_up_is_taken_off(write):
    path = write("time,x,y,z\n0,1,2,3\n1,4,5,6\n", "rover.csv")
    assert read(path, up="y")[0].positions.tolist() == [[1, -3], [4, -6]]
    assert read(path, up="-z")[0].positions.tolist() == [[1, -2], [4, -5]]


@pytest.mark.parametrize("options", [{"unit": "parsec"}, {"time_unit": "h"}, {"up": "w"}])
def test_an_unknown_unit_or_axis_is_refused(options):
    with pytest.raises(MtmError, match="give one of"):
        ReadOptions(**options)


def test_bodies_of_the_command_line_are_markers_by_name():
    assert marker_groups(["a=1, 2,3", "b=4"]) == {"a": ("1", "2", "3"), "b": ("4",)}
    for wrong in (["a"], ["=1"], ["a="], ["a=1", "a=2"]):
        with pytest.raises(MtmError, match="--body"):
            marker_groups(wrong)


def outcome(path):
    """The track, or the text of the plain error; anything else that is raised fails the test."""
    try:
        return read_log(path).tracks[0]
    except MtmError as error:
        return str(error)


@given(st.text() | st.text(alphabet="0123456789.-+einfa#, \n\r\t\"'_timexy"), st.sampled_from([".tum", ".csv"]))
def test_arbitrary_text_is_a_track_or_a_plain_error(tmp_path_factory, text, suffix):
    path = tmp_path_factory.getbasetemp() / f"robot0{suffix}"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    result = outcome(path)
    assert isinstance(result, Track) or (str(path) in result and "\n" not in result)


@given(st.lists(st.lists(st.floats(), min_size=8, max_size=8), min_size=1, max_size=5))
def test_eight_numbers_a_line_are_a_track_or_name_the_line(tmp_path_factory, rows):
    path = tmp_path_factory.getbasetemp() / "robot0.tum"
    path.write_text("\n".join(" ".join(map(str, row)) for row in rows))
    result = outcome(path)
    assert str(path) in result if isinstance(result, str) else np.isfinite(result.positions[result.valid]).all()


def test_notes_beside_a_recording_are_of_no_format(write):
    for text in ("What happened on Friday\n", "a,b,c\n1,2,3\n", "1 2 3\n"):
        assert format_of(opening_of(write(text, "notes.txt"))) is None
