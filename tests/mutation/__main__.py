"""`make mutants`: what limits a robot is changed in every small way, and each time some test has to fail.

Each mutant is imported in a process of its own in the place of the module, and the tests run until one fails. Mutants
that survive are looked up in docs/mutants.md, which says why no test could tell them apart; any other one is an error.
"""

import importlib.abc
import importlib.util
import os
import signal
import sys
import tempfile
import time
from contextlib import redirect_stdout
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import can  # noqa: F401 - here and below: imported once for all mutants
import hypothesis  # noqa: F401
import pytest

import mtm_onboard.protocol.journal_file  # noqa: F401
from tests.mutation.mutate import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
MODULE = "mtm_onboard.runtime.guard"
SOURCE = ROOT.joinpath(*MODULE.split(".")).with_suffix(".py")
EXPLAINED = ROOT / "docs" / "mutants.md"
# The quickest first; the others run with what is left.
TESTS = (
    ("tests/onboard/runtime/test_guard.py",),
    ("tests/onboard/runtime/test_tick.py", "tests/onboard/runtime/test_failsafes.py"),
)
LONGEST_S = 120


class Substitute(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives the mutant to whoever imports the module."""

    def __init__(self, source: str) -> None:
        self.source = source

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        return importlib.util.spec_from_loader(fullname, self) if fullname == MODULE else None

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self.source, str(SOURCE), "exec"), vars(module))


def survives(mutant: Mutant) -> bool:
    """Whether every test passes with the mutant; one that takes too long is noticed as well."""
    return all(_passes(mutant, tests) for tests in TESTS)


def _passes(mutant: Mutant, tests: tuple[str, ...]) -> bool:
    child = os.fork()
    if child == 0:
        signal.alarm(LONGEST_S)
        sys.meta_path.insert(0, Substitute(mutant.source))
        passed = False
        try:
            with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
                passed = pytest.main(["-x", "-q", "--assert=plain", "-p", "no:cacheprovider", *tests]) == 0
        finally:
            os._exit(int(not passed))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def main() -> int:
    """Run all; the exit code is 0 when every mutant was killed or is explained."""
    os.chdir(ROOT)
    began_s = time.monotonic()
    source, explained = SOURCE.read_text(encoding="utf-8"), EXPLAINED.read_text(encoding="utf-8")
    counts = {"killed": 0, "explained": 0, "survives": 0}
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = folder
        if not survives(Mutant("none", source)):
            print("the tests fail without any mutant; make them pass first")
            return 1
        for mutant in mutants_of(source):
            fate = "killed"
            if survives(mutant):
                fate = "explained" if f"`{mutant.name}`" in explained else "survives"
                print(f"{fate}: {mutant.name}", flush=True)
            counts[fate] += 1
    print(
        f"{sum(counts.values())} mutants of {MODULE}: {counts['killed']} killed, {counts['explained']} survive and are "
        f"explained, {counts['survives']} survive unexplained, in {time.monotonic() - began_s:.0f} s"
    )
    return int(counts["survives"] > 0)


if __name__ == "__main__":
    sys.exit(main())
