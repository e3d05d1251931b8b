from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.batch.row import COLUMNS, Row, header, lines_of, printable, row_of

TEXTS = st.text().map(printable)


@given(st.lists(st.builds(Row, **{name: TEXTS for name in COLUMNS if name != "rows"}), min_size=1, max_size=3))
def test_rows_come_back_from_their_lines(rows):
    lines = lines_of(rows).split("\n")
    assert lines[-1] == ""
    read = [row_of(line) for line in lines[:-1]]
    assert [row.rows for row in read] == [str(len(rows))] * len(rows)
    assert [lines_of([row]) for row in read] == [lines_of([row]) for row in rows]


@given(st.text())
def test_whatever_is_printed_is_one_printable_line(text):
    assert printable(text).isprintable()
    assert not text.isprintable() or printable(text) == text


@given(st.text(max_size=60))
def test_a_damaged_line_is_no_row(line):
    assert row_of(line) is None


def test_names_that_are_no_unicode_can_be_written():
    assert printable("film\udcff\n.mp4") == "film\\udcff\\n.mp4"
    printable("film\udcff").encode()


def test_the_header_names_the_columns():
    assert header() == ",".join(COLUMNS) + "\n"
    assert header().startswith("path,sha256,verdict,key,")
