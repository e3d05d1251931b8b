"""One mutant's trial: the tests run in a process of its own, with the mutant in the place of the module."""

import gc
import importlib.abc
import importlib.util
import math
import os
import resource
import signal
import sys
from contextlib import redirect_stderr, redirect_stdout
from importlib.machinery import ModuleSpec
from types import ModuleType

# Here and below: imported once for all mutants. Nothing of this project may be, or a mutant would come too late.
import can  # noqa: F401
import hypothesis.extra.numpy  # noqa: F401
import numpy  # noqa: F401
import pytest
import scipy.stats  # noqa: F401

from tests.mutation.targets import Target

# For a mutant that waits for ever, which takes no processor time.
_LONGEST_S = 300
_MOST_BYTES = 4 << 30
_UNUSED_PLUGINS = ("benchmark", "cacheprovider", "faulthandler", "junitxml", "pastebin", "doctest", "stepwise")


class Substitute(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives `source` to whoever imports the target's module."""

    def __init__(self, target: Target, source: str) -> None:
        self._target = target
        self._source = source

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        return importlib.util.spec_from_loader(fullname, self) if fullname == self._target.module else None

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._source, str(self._target.source), "exec"), vars(module))


def processor_time_s(target: Target, source: str) -> float | None:
    """Processor time that the target's tests take when all of them pass; None when one fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    passed = survives(target, source, 600.0)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before if passed else None


def survives(target: Target, source: str, longest_cpu_s: float) -> bool:
    """Whether every test of the target passes with `source` in the place of its module.

    A mutant that comes to no end has been noticed: no file of tests may take more than `longest_cpu_s` of processor
    time, which a busy machine does not stretch.
    """
    # What is there already is no garbage of the children's, who would look through it several times.
    gc.freeze()
    if target.module in sys.modules:
        raise RuntimeError(f"{target.module} was imported already, so that no mutant would take its place")
    return all(_passes(target, source, tests, longest_cpu_s) for tests in target.tests)


def _passes(target: Target, source: str, tests: str, longest_cpu_s: float) -> bool:
    child = os.fork()
    if child == 0:
        passed = False
        try:
            _limit(longest_cpu_s)
            sys.meta_path.insert(0, Substitute(target, source))
            # Without the benchmarks' plugin, which asks git about the machine's state each time.
            options = ["-o", "addopts=", "--import-mode=importlib", "-x", "-q", "--assert=plain"]
            options += [part for name in _UNUSED_PLUGINS for part in ("-p", f"no:{name}")]
            with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
                passed = pytest.main([*options, tests]) == 0
        finally:
            os._exit(int(not passed))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def _limit(longest_cpu_s: float) -> None:
    signal.alarm(_LONGEST_S)
    most_s = math.ceil(longest_cpu_s)
    resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s))
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
