"""Two recordings beside each other."""

from itertools import zip_longest
from pathlib import Path

from tests.behaviour.recording import SUFFIX

_LINES_SHOWN = 5


def is_recording(folder: Path) -> bool:
    """Whether there is any transcript in it."""
    return any(folder.glob(f"*{SUFFIX}"))


def differences(before: Path, after: Path) -> dict[str, list[str]]:
    """What to say about each command that differs, by name; empty when all are the same."""
    names = sorted({path.name for folder in (before, after) for path in folder.glob(f"*{SUFFIX}")})
    found = {name.removesuffix(SUFFIX): _difference(before / name, after / name) for name in names}
    return {name: lines for name, lines in found.items() if lines}


def _difference(before: Path, after: Path) -> list[str]:
    for path in (before, after):
        if not path.is_file():
            return [f"{path} is missing"]
    return differing_lines(before.read_bytes().decode(), after.read_bytes().decode())


def differing_lines(before: str, after: str) -> list[str]:
    """The first lines that differ, and how many more do."""
    pairs = zip_longest(before.split("\n"), after.split("\n"))
    differing = [(number, pair) for number, pair in enumerate(pairs, 1) if pair[0] != pair[1]]
    said = []
    for number, pair in differing[:_LINES_SHOWN]:
        said += [f"line {number}:"]
        said += [f"  {sign} {line}" for sign, line in zip("-+", pair, strict=True) if line is not None]
    if len(differing) > _LINES_SHOWN:
        said.append(f"and {len(differing) - _LINES_SHOWN} more lines")
    return said
