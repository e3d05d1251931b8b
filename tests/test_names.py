"""Names of tests are statements that fit into a line of a report."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

LONGEST = 60
ROOT = Path(__file__).parent
FILES = sorted(ROOT.rglob("*.py"))


def names(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_"):
            yield node.name


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_names_have_60_letters_at_most(file):
    assert [name for name in names(file) if len(name) > LONGEST] == []


def test_there_are_names_to_look_at():
    assert sum(1 for file in FILES for _ in names(file)) > 1000
