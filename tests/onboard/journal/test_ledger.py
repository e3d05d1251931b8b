import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.protocol import MtmError

FINGERPRINT = "0123456789abcdef"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "r.state"


def opened(path, key_id="fake-key"):
    return Ledger(path, key_id, FINGERPRINT)


def test_slots_and_numbers_are_found_again(path):
    with opened(path) as ledger:
        assert ledger.last_slot == -1
        ledger.reserve(40)
        ledger.reserve(7)
        assert [ledger.take_number() for _ in range(3)] == [0, 1, 2]
    with opened(path) as ledger:
        assert ledger.last_slot == 40
        assert ledger.take_number() == 3
        ledger.release(38)
    with opened(path) as ledger:
        assert ledger.last_slot == 38
    assert os.stat(path).st_mode & 0o777 == 0o600


def test_a_kill_between_two_slots_forgets_none(path):
    ledger = opened(path)
    ledger.reserve(40)
    del ledger
    # What a killed program leaves is the file; its lock goes with it.
    assert "last_slot = 40" in path.read_text()


def test_each_key_has_its_own_entry(path):
    with opened(path) as ledger:
        ledger.reserve(40)
    with opened(path, "other-key") as ledger:
        assert ledger.last_slot == -1
        ledger.reserve(3)
    with opened(path) as ledger:
        assert ledger.last_slot == 40


def test_two_runs_at_once_are_refused(path):
    with opened(path), pytest.raises(MtmError, match="another run"):
        opened(path)
    with opened(path):
        pass


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(MtmError, match="choose a folder"):
        opened(tmp_path / "none" / "r.state")


@pytest.mark.parametrize(
    "text",
    [
        "no toml",
        "format = 2\n",
        "format = 1\nkeys = 3\n",
        'format = 1\n[[keys]]\nid = "a"\n',
        'format = 1\n[[keys]]\nid = "a"\nfingerprint = "b"\nlast_slot = 1.5\nnext_number = 1\n',
        'format = 1\n[[keys]]\nid = "a"\nfingerprint = "b"\nlast_slot = -2\nnext_number = 1\n',
        'format = 1\n[[keys]]\nid = "a\\""\nfingerprint = "b"\nlast_slot = 1\nnext_number = 1\n',
    ],
)
def test_a_damaged_ledger_is_never_taken_for_an_empty_one(path, text):
    path.write_text(text)
    with pytest.raises(MtmError, match="is damaged"):
        opened(path)
    assert path.read_text() == text


@given(text=st.text(max_size=80))
def test_any_text_is_read_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("ledger") / "r.state"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(MtmError, match="damaged|more than"):
        opened(path)
