from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.planning.table import AccuracyPoint, AccuracyTable, read_table, write_table
from mtm_onboard.protocol import MtmError

HEADER = "channel,M,t,successes,trials\n"
CELLS = st.tuples(st.sampled_from(["x", "y", "x+y"]), st.integers(2, 64), st.integers(1, 5000))


@st.composite
def tables(draw):
    points = []
    for channel, alphabet, ticks in draw(st.lists(CELLS, min_size=1, max_size=12, unique=True)):
        trials = draw(st.integers(1, 1000))
        points.append(AccuracyPoint(channel, alphabet, ticks, draw(st.integers(0, trials)), trials))
    return AccuracyTable(tuple(points))


@given(tables())
def test_a_table_returns_what_was_written(tmp_path_factory, table):
    path = tmp_path_factory.mktemp("tables") / "a.csv"
    write_table(path, table, ("how it was measured",))
    assert read_table(path) == table


def test_comments_blank_lines_and_spaces_are_fine(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("# measured\n\nchannel, M, t, successes, trials\n# more\nx, 4, 48, 7, 10\n", encoding="utf-8-sig")
    assert read_table(path).points == (AccuracyPoint("x", 4, 48, 7, 10),)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("x,4,48,11,10\n", "line 2: 11 successes of 10 trials would be an accuracy above 1; give at most as many"),
        ("x,4,48,-1,10\n", "successes is -1; give 0 to"),
        ("x,4,48,0,0\n", "trials is 0; give 1 to"),
        ("x,1,48,0,5\n", "M is 1; give 2 to 65536"),
        ("x,4,,7,10\n", "line 2: t is missing; fill the cell, or leave the whole row out"),
        ("x,4,48,7\n", "trials is missing"),
        ("x,4,48,7,10,3\n", "there are 6 cells; give the 5 of the header"),
        ("x,4,48,0.7,1\n", "successes is '0.7'; give a whole number"),
        ("x+x,4,48,7,10\n", "'x.x' names no channels"),
        ("x,4,48,7,10\nx,4,48,6,10\n", "x at M = 4, t = 48 stands twice in the table; add up"),
        ("x+y,4,48,7,10\ny+x,4,48,6,10\n", "stands twice"),
        ("", "has no rows; measure at least one channel"),
    ],
)
def test_an_impossible_table_is_refused_with_its_place(tmp_path, rows, says):
    path = tmp_path / "a.csv"
    path.write_text(HEADER + rows)
    with pytest.raises(MtmError, match=says) as refusal:
        read_table(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x89PNG\r\n\x1a\n", "is not a CSV file"),
        (HEADER.encode() + b'"x,4,48,7,10\n', "is not a CSV file"),
        (b"time,x,y\n0,1,2\n", "does not begin with the header channel,M,t,successes,trials"),
        (b"", "does not begin with the header"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, content, says):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(MtmError, match=says):
        read_table(path)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(MtmError, match="check the name"):
        read_table(tmp_path / "none.csv")


@given(st.binary(max_size=200))
def test_no_file_breaks_the_reader(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("tables") / "a.csv"
    path.write_bytes(HEADER.encode() + content)
    with suppress(MtmError):
        assert read_table(path).points
