"""Functions for worker processes, which import what they compute from a module."""

import importlib
import os
import sys

import pytest

MODULE = '''
import os
import signal
import time
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError


def square(number):
    return number**2, os.getpid(), os.environ["OMP_NUM_THREADS"]


def killed_by_two(number):
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def killed_at_first(path):
    if not Path(path).exists():
        Path(path).touch()
        os._exit(1)
    return "done"


def refused(number):
    raise MtmError("this machine has no key")


def broken(number):
    raise ZeroDivisionError("odd")


def for_ever(path):
    Path(path).write_text(str(os.getpid()))
    time.sleep(600)


def logged(argument):
    """Tell in a file that the work began, and take a while."""
    path, seconds = argument
    with open(path, "a") as log:
        log.write(f"{os.getpid()}\\n")
    time.sleep(seconds)
    return "done"
'''


@pytest.fixture
def calls(tmp_path, monkeypatch):
    """The module, for this process and those that it starts."""
    (tmp_path / "calls_of_a_batch.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "calls_of_a_batch", raising=False)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    return importlib.import_module("calls_of_a_batch")
