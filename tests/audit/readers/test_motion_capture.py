import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.model.track import Track
from mtm_audit.readers.motion_capture import read_csv, read_motion_capture, read_tum
from mtm_onboard.protocol import MtmError


@pytest.fixture
def write(tmp_path):
    def _write(text, name="robot0.tum"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return _write


def test_a_tum_file_gives_positions_and_headings(write):
    track = read_tum(
        write("# timestamp tx ty tz qx qy qz qw\n0.0 1 2 3 0 0 0 1\n\n0.5 4 5 6 0 0 0.70710678 0.70710678\n")
    )
    assert track.name == "robot0"
    assert track.unit == "m"
    assert track.times_s.tolist() == [0.0, 0.5]
    assert track.positions.tolist() == [[1, 2], [4, 5]]
    assert track.headings_rad == pytest.approx([0, np.pi / 2])


def test_the_heading_of_a_pitched_body_is_its_yaw(write):
    yaw, pitch = 0.7, 0.2
    cy, sy, cp, sp = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    line = " ".join(str(value) for value in (0, 0, 0, 0, -sy * sp, cy * sp, sy * cp, cy * cp))
    assert read_tum(write(line)).headings_rad == pytest.approx([yaw])


def test_a_line_with_nan_is_an_unobserved_sample(write):
    track = read_tum(write("0 1 2 3 0 0 0 1\n1 nan nan nan nan nan nan nan\n2 1 2 3 0 0 0 1\n"))
    assert track.valid.tolist() == [True, False, True]
    assert np.isnan(track.positions[1]).all()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n# note\n1 0 0 0 0 0 0 1\n", "line 4.*sort the lines"),
        ("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "line 2.*remove repeated"),
        ("0 0 0 0 0 0 1\n", "line 1: expected 8 numbers"),
        ("0 0 0 zero 0 0 0 1\n", "line 1: expected 8 numbers"),
        ("nan 0 0 0 0 0 0 1\n", "line 1: the time is not a number"),
        ("# nothing\n", "holds no samples"),
        ("", "is empty"),
        (b"\xff\xfe\x00\x01", "not UTF-8 text"),
    ],
)
def test_a_bad_file_is_refused_with_one_sentence(write, text, says):
    with pytest.raises(MtmError, match=says):
        read_motion_capture(write(text))


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(MtmError, match="check the name"):
        read_motion_capture(tmp_path / "robot0.tum")
    with pytest.raises(MtmError, match="folder"):
        read_motion_capture(tmp_path)


def test_a_csv_table_is_read_by_its_header(write):
    track = read_csv(write("time, X, y, yaw, quality\n0,1,2,0.1,9\n1,,,,9\n2,3,4,0.2,9\n", "rover.csv"))
    assert track.name == "rover"
    assert track.valid.tolist() == [True, False, True]
    assert track.positions[2].tolist() == [3, 4]
    assert track.headings_rad[0] == 0.1


def test_a_csv_table_without_yaw_has_no_headings(write):
    assert read_motion_capture(write("time,x,y\n0,1,2\n1,3,4\n", "rover.txt")).headings_rad is None


def test_a_csv_table_that_lacks_a_column_is_refused(write):
    with pytest.raises(MtmError, match="lacks the column 'x'"):
        read_csv(write("time,y\n0,1\n", "rover.csv"))


def outcome(read, path):
    """The track, or the text of the plain error; anything else that is raised fails the test."""
    try:
        return read(path)
    except MtmError as error:
        return str(error)


@given(st.text() | st.text(alphabet="0123456789.-+einfa#, \n\r\t\"'_timexy"), st.sampled_from([".tum", ".csv"]))
def test_arbitrary_text_is_a_track_or_a_plain_error(tmp_path_factory, text, suffix):
    path = tmp_path_factory.getbasetemp() / f"robot0{suffix}"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    result = outcome(read_motion_capture, path)
    assert isinstance(result, Track) or (str(path) in result and "\n" not in result)


@given(st.lists(st.lists(st.floats(), min_size=8, max_size=8), min_size=1, max_size=5))
def test_eight_numbers_a_line_are_a_track_or_name_the_line(tmp_path_factory, rows):
    path = tmp_path_factory.getbasetemp() / "robot0.tum"
    path.write_text("\n".join(" ".join(map(str, row)) for row in rows))
    result = outcome(read_tum, path)
    assert "line" in result if isinstance(result, str) else np.isfinite(result.positions[result.valid]).all()


def test_a_position_beyond_anything_seen_names_its_line(tmp_path):
    path = tmp_path / "robot0.tum"
    path.write_text("0 0 0 0 0 0 0 1\n0.1 1e300 0 0 0 0 0 1\n0.2 0 0 0 0 0 0 1\n")
    with pytest.raises(MtmError, match="line 2: a position beyond 1e\\+09 m"):
        read_tum(path)
