"""Waiting for what threads, processes and the kernel do in their own time.

Nothing is as slow as this: it is how long a test waits before it says that what it waits for never comes, so that a
busy machine makes a test slower and never makes it fail.
"""

import time
from collections.abc import Callable
from typing import TypeVar

PATIENCE_S = 60.0
_PAUSE_S = 0.01

T = TypeVar("T")


def until(condition: Callable[[], T]) -> T:
    """The first true answer of `condition`; fails when there is none in a minute."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not (answer := condition()):
        assert time.monotonic() < deadline_s, "what was waited for never came"
        time.sleep(_PAUSE_S)
    return answer
