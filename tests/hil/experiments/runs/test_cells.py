import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.experiments.runs.cells import Cell, CellStore
from mtm_onboard.protocol import MtmError

A, B = Cell("test", {"x": 1, "y": "one"}, 0), Cell("test", {"x": 1, "y": "one"}, 1)


def test_a_finished_cell_is_there_when_the_store_is_opened_again(tmp_path):
    with CellStore(tmp_path / "above" / "cells.jsonl") as store:
        store.add(A, {"margin": 0.25, "correct": 3})
    with CellStore(tmp_path / "above" / "cells.jsonl") as store:
        assert store.find(A) == {"margin": 0.25, "correct": 3}
        assert store.find(Cell("test", {"y": "one", "x": 1}, 0)) == store.find(A)
        assert store.find(B) is None


@given(st.integers(1, 60))
def test_a_line_that_was_cut_short_costs_itself_alone(tmp_path_factory, cut):
    path = tmp_path_factory.mktemp("store") / "cells.jsonl"
    with CellStore(path) as store:
        store.add(A, {"margin": 0.25})
        whole = path.stat().st_size
        store.add(B, {"margin": 0.5})
    with path.open("rb+") as file:
        file.truncate(max(whole, path.stat().st_size - cut))
    with CellStore(path) as store:
        assert store.find(A) == {"margin": 0.25}
        assert store.find(B) is None
        store.add(B, {"margin": 0.75})
    with CellStore(path) as store:
        assert (store.find(A), store.find(B)) == ({"margin": 0.25}, {"margin": 0.75})


def test_what_other_code_computed_is_not_used(tmp_path):
    with CellStore(tmp_path / "cells.jsonl", code="old") as store:
        store.add(A, {"margin": 0.25})
    with CellStore(tmp_path / "cells.jsonl") as store:
        assert store.find(A) is None
    with CellStore(tmp_path / "cells.jsonl", code="old") as store:
        assert store.find(A) == {"margin": 0.25}


@pytest.mark.parametrize("line", [b"hello\n", b"[]\n", b'{"code": "x"}\n', b"no end", b'{"coda'])
def test_a_file_that_is_no_store_is_refused_and_kept(tmp_path, line):
    (tmp_path / "cells.jsonl").write_bytes(line)
    with pytest.raises(MtmError, match=r"line 1.*another file"):
        CellStore(tmp_path / "cells.jsonl", code="x")
    assert (tmp_path / "cells.jsonl").read_bytes() == line


def test_a_folder_that_cannot_be_written_gets_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(MtmError, match="cannot write"):
        CellStore(tmp_path / "file" / "cells.jsonl")
