"""What became of each mutant, kept from run to run, and the report that is committed."""

import hashlib
import json
import re
from dataclasses import dataclass, field
from pathlib import Path

from tests.mutation.targets import ROOT, Target

EXPLAINED = ROOT / "docs" / "mutants.md"
REPORT = ROOT / "docs" / "mutants_report.md"
_STATE = ROOT / "out" / "mutants.json"
_HEAD = """# Mutation report

Written by `make mutants`, which says in [mutants.md](mutants.md) what it does and why each survivor is none of the
tests' fault. The digest is the first eight digits of the SHA-256 of the module as it was when its mutants were made:
`sha256sum` of the file tells whether a row is still of this source.

| module | digest | tests | mutants | killed | explained | unexplained | not tried |
| --- | --- | --- | ---: | ---: | ---: | ---: | ---: |
"""


@dataclass
class Fates:
    """A target's mutants that were tried: name -> killed. Good for one state of the source and of its tests."""

    target: Target
    digest: str
    tried: dict[str, bool] = field(default_factory=dict)


def load_fates(target: Target) -> Fates:
    """What an earlier run found out about the target; nothing when its source or its tests are others now."""
    fresh = Fates(target, _digest([target.source, *(ROOT / test for test in target.tests)]))
    known = _read_state().get(target.module, {})
    return Fates(target, fresh.digest, known["tried"]) if known.get("digest") == fresh.digest else fresh


def keep(fates: Fates) -> None:
    """Write what was found out, so that another run goes on from there."""
    table = _read_state() | {fates.target.module: {"digest": fates.digest, "tried": fates.tried}}
    _STATE.parent.mkdir(exist_ok=True)
    _replace(_STATE, json.dumps(table, indent=1))


def explained_mutants() -> dict[str, set[str]]:
    """Module -> the mutants whose survival docs/mutants.md explains under the module's heading."""
    sections = re.split(r"^## `(.+)`\n", EXPLAINED.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return {
        module: set(re.findall(r"^- `(.+)`$", text, flags=re.MULTILINE))
        for module, text in zip(sections[::2], sections[1::2], strict=True)
    }


@dataclass(frozen=True)
class Row:
    """A line of the report."""

    module: str
    digest: str
    tests: tuple[str, ...]
    killed: int
    explained: int
    unexplained: int
    not_tried: int

    def text(self) -> str:
        tests = ", ".join(f"`{Path(test).stem}`" for test in self.tests)
        counts = (self.killed, self.explained, self.unexplained, self.not_tried)
        numbers = " | ".join(map(str, (sum(counts), *counts)))
        return f"| `{self.module}` | `{self.digest}` | {tests} | {numbers} |"


def row_of(fates: Fates, names: list[str], explained: set[str]) -> Row:
    """The target's line, of all its mutants `names`."""
    survivors = [name for name in names if fates.tried.get(name) is False]
    told = sum(name in explained for name in survivors)
    killed = sum(fates.tried.get(name) is True for name in names)
    return Row(fates.target.module, _digest([fates.target.source])[:8], fates.target.tests, killed, told,
               len(survivors) - told, len(names) - killed - len(survivors))  # fmt: skip


def write_report(rows: list[Row]) -> None:
    """Replace the committed report."""
    _replace(REPORT, _HEAD + "".join(f"{row.text()}\n" for row in rows))


def _read_state() -> dict[str, dict[str, object]]:
    return json.loads(_STATE.read_text(encoding="utf-8")) if _STATE.exists() else {}


def _replace(path: Path, text: str) -> None:
    """Write a file whole; without the program's own function for it, which is among what is mutated."""
    temporary = path.with_suffix(".new")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def _digest(files: list[Path]) -> str:
    whole = hashlib.sha256()
    for file in files:
        whole.update(file.read_bytes())
    return whole.hexdigest()
