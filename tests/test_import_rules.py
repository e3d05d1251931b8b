"""Imports run one way: between packages, between the rooms of a package, and between modules.

hil -> mtm_audit -> mtm_onboard.protocol, and hil -> mtm_onboard.
"""

import ast
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("mtm_onboard", "mtm_audit", "hil")

# The rooms of each package, lowest first: a room imports from itself and from those before it. A room is a folder or
# a module; the longest name that fits is the room of a module. The package's own __init__ stands above all of them.
LEVELS = {
    "mtm_onboard": (
        "loading", "protocol", "model", "journal", "links", "runtime", "firmware", "control", "policies", "ros",
        "doctor", "commands", "cli", "__main__",
    ),
    "mtm_audit": (
        "model", "readers", "tracking", "drawing", "ingest", "detectors", "survey", "significance", "decoding",
        "reporting", "planning", "batch", "live", "commands", "cli", "__main__",
    ),
    "hil": (
        "plants", "wires", "vehicles", "sensors", "worlds", "fleet", "experiments.runs", "experiments.detectors",
        "experiments.worlds", "experiments.messages", "experiments.hardening", "experiments", "commands", "cli",
        "__main__",
    ),
}  # fmt: skip

# Arrows that still point up, as (room, imported room).

# Imports every module of mtm_onboard while nothing but numpy and the standard library can be found.
NUMPY_ALONE = """
import importlib, pkgutil, sys

class Nothing:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top not in sys.stdlib_module_names | {"numpy", "mtm_onboard"}:
            raise ModuleNotFoundError(f"No module named {name!r} on the robot", name=name)

sys.meta_path.insert(0, Nothing())
import mtm_onboard
names = [module.name for module in pkgutil.walk_packages(mtm_onboard.__path__, "mtm_onboard.")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""


def imported(path: Path) -> set[str]:
    """Names of the modules that a file imports anywhere, also inside functions."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively; name the package"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@cache
def module_graph() -> dict[str, set[str]]:
    """For each module of ours, those of ours that it names in its imports."""
    paths = {}
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        paths[name.removesuffix(".__init__")] = path
    # A name imported from a module is either a module below it or something that it defines.
    return {
        module: {name if name in paths else name.rpartition(".")[0] for name in imported(path)} & paths.keys()
        for module, path in paths.items()
    }


def broken(package: str, allowed: tuple[str, ...]) -> list[str]:
    """Imports of our own packages in `package` that begin with none of `allowed`."""
    return [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for name in sorted(imported(path))
        if name.partition(".")[0] in PACKAGES and not f"{name}.".startswith(allowed)
    ]


def room_of(module: str, levels: tuple[str, ...]) -> str | None:
    """The room that a module lies in; None for the package itself and for what no level names."""
    inside = module.partition(".")[2]
    rooms = [room for room in levels if f"{inside}.".startswith(f"{room}.")]
    return max(rooms, key=len, default=None)


def upward(graph: dict[str, set[str]], package: str, levels: tuple[str, ...]) -> dict[tuple[str, str], list[str]]:
    """Imports within a package that point to a room above the importing one, by (room, imported room)."""
    found: dict[tuple[str, str], list[str]] = {}
    for module, names in graph.items():
        here = room_of(module, levels)
        if module.partition(".")[0] != package or here is None:
            continue
        for name in sorted(name for name in names if name.partition(".")[0] == package):
            there = room_of(name, levels)
            if there is None or levels.index(there) > levels.index(here):
                found.setdefault((f"{package}.{here}", f"{package}.{there}"), []).append(f"{module} -> {name}")
    return found


def circle_in(graph: dict[str, set[str]]) -> list[str]:
    """One circle of imports, from a module back to it; empty when there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@pytest.mark.parametrize(
    ("package", "allowed"),
    [("mtm_onboard", ("mtm_onboard.",)), ("mtm_audit", ("mtm_audit.", "mtm_onboard.protocol."))],
)
def test_a_package_imports_only_what_lies_below_it(package, allowed):
    assert broken(package, allowed) == []


def test_the_rule_would_notice_a_wrong_import():
    assert broken("mtm_onboard", ("mtm_onboard.protocol.",))
    assert broken("mtm_audit", ("mtm_audit.",))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_lies_in_a_room(package):
    modules = [name for name in module_graph() if name.startswith(f"{package}.")]
    assert [name for name in modules if room_of(name, LEVELS[package]) is None] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_room_imports_from_one_above_it(package):
    found = upward(module_graph(), package, LEVELS[package])
    assert found == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_the_levels_would_notice_an_arrow_that_points_up(package):
    assert upward(module_graph(), package, LEVELS[package][::-1])


def test_no_modules_import_each_other_in_a_circle():
    assert circle_in(module_graph()) == []


def test_a_circle_would_be_noticed():
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}})


def test_the_robot_s_package_needs_numpy_alone():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", NUMPY_ALONE], capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert int(done.stdout) >= 20
