"""Damaged recordings are read or refused in one sentence; `tests/audit/readers/fuzz.py` tries many more."""

import random

import pytest

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


def test_a_reader_that_fails_otherwise_is_told(tmp_path, monkeypatch):
    path, _ = original("tum", tmp_path)
    monkeypatch.setattr("mtm_audit.readers.logs.registry.opening_of", lambda _: 1 / 0)
    assert outcome(path)[0] == "traceback"
