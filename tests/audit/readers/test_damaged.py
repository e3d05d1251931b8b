"""Damaged recordings are read or refused in one sentence; `tests/audit/readers/fuzz.py` tries many more."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.audit.readers.every_format import ALL, TEXT
from tests.audit.readers.fuzz import damaged, original, outcome

# What libraries leave to be collected complains of files that they did not close.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
# One starts a process for each.
FEW = {"c3d": 6}


@pytest.mark.parametrize("name", ALL)
def test_a_damaged_recording_leaves_no_traceback(tmp_path, name):
    path, data = original(name, tmp_path)
    count = FEW.get(name, 150 if name in TEXT else 40)
    for number in range(count):
        path.write_bytes(damaged(random.Random(f"{name} test {number}"), data))
        result, text = outcome(path)
        assert result in ("read", "refused"), f"{number}: {text}"


@pytest.mark.parametrize("name", ALL)
def test_an_undamaged_recording_is_read(tmp_path, name):
    path, _ = original(name, tmp_path)
    assert outcome(path) == ("read", "")


@pytest.mark.parametrize("name", ["tum", "csv", "motive 1.23", "vicon tracker", "qualisys 6d", "kitti", "euroc"])
def test_numbers_without_an_end_make_no_library_warn(tmp_path, name):
    path, data = original(name, tmp_path)
    lines = data.splitlines(keepends=True)
    separator = next(mark for mark in (b",", b"\t", b" ") if mark in lines[-1])
    first = next(place for place, line in enumerate(lines) if separator in line and line[:1].isdigit())
    for row in (first, len(lines) // 2, len(lines) - 1):
        cells = lines[row].split(separator)
        for column in range(len(cells) - 1):
            changed = separator.join([*cells[:column], b"inf", *cells[column + 1 :]])
            path.write_bytes(b"".join([*lines[:row], changed, *lines[row + 1 :]]))
            result, text = outcome(path)
            assert result in ("read", "refused"), text


def test_a_reader_that_fails_otherwise_is_told(tmp_path, monkeypatch):
    path, _ = original("tum", tmp_path)
    monkeypatch.setattr("mtm_audit.readers.logs.registry.opening_of", lambda _: 1 / 0)
    assert outcome(path)[0] == "traceback"


MAGICS = (
    b"ULog\x01\x12\x35", b"\xa3\x95\x80", b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"\xbc\x02\x00\x01\x00\x07\x00a",
    b"PAR1", b"\x00\x05\xf0\x00\x00\x00\x00\x00\xfd", b"Format Version,1.23\n", b"Objects\n100\n", b"NO_OF_FRAMES\t1\n",
    b"%time,field.header.stamp\n", b"Timestamp,stateEstimate.x,stateEstimate.y\n", b"\xff\xfe", b"\xef\xbb\xbf",
)  # fmt: skip


@given(st.sampled_from(MAGICS), st.binary(max_size=300), st.sampled_from([".bin", ".csv", ".db3", ".tsv"]))
def test_anything_behind_a_known_beginning_is_refused(tmp_path_factory, magic, rest, suffix):
    path = tmp_path_factory.getbasetemp() / f"robot0{suffix}"
    path.write_bytes(magic + rest)
    assert outcome(path)[0] in ("read", "refused")
