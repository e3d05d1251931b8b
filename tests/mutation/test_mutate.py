import ast

import pytest

from tests.mutation.mutate import mutants_of

SOURCE = '''
if TYPE_CHECKING:
    from typing import Any

LIMIT = 3

class Counter:
    """Counts."""

    start: int = 0

    def add(self, part: float = 1.0) -> bool:
        """Say whether `part` was counted."""
        if 0 < part <= LIMIT and not self.closed:
            self.count += 1
            self.last = min(part, -LIMIT)
            self.tell(f"{part:.3f} of 7")
            if part in self.known:
                self.word = self.word << 1 ^ part % 2
            return True
        raise ValueError("at most 3")
'''


def changes() -> dict[str, str]:
    return {mutant.name.partition(": ")[2]: mutant.source for mutant in mutants_of(SOURCE)}


@pytest.mark.parametrize(
    "change",
    [
        "LIMIT = 3 -> LIMIT = 7",
        "start: int = 0 -> start: int = 1",
        "if 0 < part <= LIMIT and (not self.closed) -> if True",
        "if 0 < part <= LIMIT and (not self.closed) -> if False",
        "if 0 < part <= LIMIT and (not self.closed) -> if 0 <= part <= LIMIT and (not self.closed)",
        "if 0 < part <= LIMIT and (not self.closed) -> if 0 < part < LIMIT and (not self.closed)",
        "if 0 < part <= LIMIT and (not self.closed) -> if 0 < part <= LIMIT or not self.closed",
        "if 0 < part <= LIMIT and (not self.closed) -> if 0 < part <= LIMIT and self.closed",
        "self.count += 1 -> self.count -= 1",
        "self.count += 1 -> pass",
        "self.last = min(part, -LIMIT) -> self.last = max(part, -LIMIT)",
        "self.last = min(part, -LIMIT) -> self.last = min(part, LIMIT)",
        "self.last = min(part, -LIMIT) -> pass",
        "self.tell(f'{part:.3f} of 7') -> pass",
        "return True -> return False",
        "if part in self.known -> if part not in self.known",
        "self.word = self.word << 1 ^ part % 2 -> self.word = self.word >> 1 ^ part % 2",
        "self.word = self.word << 1 ^ part % 2 -> self.word = self.word << 1 | part % 2",
        "self.word = self.word << 1 ^ part % 2 -> self.word = self.word << 1 ^ part // 2",
    ],
)
def test_every_small_mistake_is_made(change):
    assert change in changes()


def test_each_mutant_is_another_program_that_compiles():
    sources = {ast.unparse(ast.parse(SOURCE)), *(mutant.source for mutant in mutants_of(SOURCE))}
    assert len(sources) == 1 + len(mutants_of(SOURCE))
    for source in sources:
        compile(source, "mutant", "exec")


def test_texts_and_annotations_stay_as_they_are():
    for source in changes().values():
        assert '"""Counts."""' in source
        assert "at most 3" in source
        assert "part: float" in source
        assert "if TYPE_CHECKING" in source


def test_a_name_says_in_which_function_the_change_is():
    assert {mutant.name.partition(": ")[0] for mutant in mutants_of(SOURCE)} == {"module", "Counter", "Counter.add"}
