"""Imports run one way: hil -> mtm_audit -> mtm_onboard.protocol, and hil -> mtm_onboard."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

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


def broken(package: str, allowed: tuple[str, ...]) -> list[str]:
    """Imports of our own packages in `package` that begin with none of `allowed`."""
    return [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for name in sorted(imported(path))
        if name.partition(".")[0] in ("mtm_onboard", "mtm_audit", "hil") and not f"{name}.".startswith(allowed)
    ]


@pytest.mark.parametrize(
    ("package", "allowed"),
    [("mtm_onboard", ("mtm_onboard.",)), ("mtm_audit", ("mtm_audit.", "mtm_onboard.protocol."))],
)
def test_a_package_imports_only_what_lies_below_it(package, allowed):
    assert broken(package, allowed) == []


def test_the_rule_would_notice_a_wrong_import():
    assert broken("mtm_onboard", ("mtm_onboard.protocol.",))
    assert broken("mtm_audit", ("mtm_audit.",))


def test_the_robot_s_package_needs_numpy_alone():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", NUMPY_ALONE], capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert int(done.stdout) >= 20
