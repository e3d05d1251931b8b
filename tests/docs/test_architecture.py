"""docs/architecture.md says what is: its levels are those of the imports, and its files exist."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PACKAGES = ("mtm_onboard", "mtm_audit", "hil")
# Not rooms: they only say what the package exports, or start its command line.
ENTRANCES = {"__init__", "__main__"}


def levels_of(package: str) -> dict[str, int]:
    """Level of each room, as the page has it."""
    section = PAGE.split(f"### {package}\n")[1].split("\n#")[0]
    rows = re.findall(r"^\| (\d+) \| ([^|]+) \|", section, re.MULTILINE)
    return {room: int(level) for level, rooms in rows for room in re.findall(r"`(\w+)`", rooms)}


def rooms_of(package: str) -> dict[str, list[Path]]:
    rooms: dict[str, list[Path]] = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        rooms.setdefault(path.relative_to(ROOT / package).parts[0].removesuffix(".py"), []).append(path)
    return {room: paths for room, paths in rooms.items() if room not in ENTRANCES}


def imported_rooms(path: Path, package: str) -> set[str]:
    """Rooms of its own package that a file imports anywhere, also inside functions."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    parts = [name.split(".") for name in names]
    return {part[1] for part in parts if part[0] == package and len(part) > 1}


def upward_imports(package: str, levels: dict[str, int]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)} (level {levels[room]}) imports {other} (level {levels[other]})"
        for room, paths in rooms_of(package).items()
        for path in paths
        for other in sorted(imported_rooms(path, package) & levels.keys())
        if other != room and levels[other] >= levels[room]
    ]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_has_a_level(package):
    assert levels_of(package).keys() == rooms_of(package).keys()


@pytest.mark.parametrize("package", PACKAGES)
def test_a_room_imports_from_lower_levels_only(package):
    assert upward_imports(package, levels_of(package)) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_a_room_on_a_wrong_level_would_be_noticed(package):
    levels = levels_of(package)
    assert upward_imports(package, {room: -level for room, level in levels.items()})


def test_every_file_that_the_page_names_exists():
    named = re.findall(r"`((?:mtm_onboard|mtm_audit|hil|results|firmware_shim)/[^`*<]+)`", PAGE)
    assert len(named) > 80
    assert [name for name in named if not (ROOT / name).exists()] == []
