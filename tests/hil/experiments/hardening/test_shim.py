import csv
import re
import shutil

import pytest

from hil.cli import main


@pytest.fixture(autouse=True)
def _c_compiler():
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler here; install gcc")
    pytest.importorskip("cffi", reason="the C shim is called through cffi; run make setup")


def test_the_shim_s_messages_come_through_as_python_s_do(tmp_path, capsys):
    with pytest.raises(SystemExit) as ending:
        main(["shim", "-n", "3", "--out", str(tmp_path / "a.csv"), "--cells", str(tmp_path / "cells.jsonl")])
    assert ending.value.code == 0
    assert "same symbols from both: 3 of 3" in capsys.readouterr().out
    first, _, _, apart, *lines = (tmp_path / "a.csv").read_text().splitlines()
    assert first.startswith("# mtm-hil shim -n 3 --out ")
    assert re.search(r"at most 0\.\d+ mm in half of the rollouts, 0\.\d+ mm in all", apart)
    assert [row["messages"] for row in csv.DictReader(lines)] == ["3", "3", "3"]
