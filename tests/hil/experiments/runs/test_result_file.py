import ast
import csv
from pathlib import Path

import pytest

import hil
from hil.experiments.runs.fingerprint import code_fingerprint
from hil.experiments.runs.result_file import write_result_csv
from mtm_onboard.protocol import MtmError


def test_a_file_says_what_made_it(tmp_path):
    write_result_csv(tmp_path / "a.csv", "mtm-hil bench", ("x", "y"), [(1, 'with "quotes", and commas')], ("a note",))
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["# mtm-hil bench", f"# code {code_fingerprint()}", "# a note"]
    assert list(csv.reader(lines[3:])) == [["x", "y"], ["1", 'with "quotes", and commas']]


def test_a_file_that_cannot_be_written_gets_one_sentence(tmp_path):
    with pytest.raises(MtmError, match="nowhere"):
        write_result_csv(tmp_path / "nowhere" / "a.csv", "mtm-hil bench", ("x",), [])


def test_nothing_else_in_hil_writes_csv():
    """A second way to write results would be one without the fingerprint."""
    writers = [
        path.name
        for path in Path(hil.__path__[0]).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and node.attr in ("writer", "DictWriter")
    ]
    assert writers == ["result_file.py"]
