"""A line that takes nothing, met by a link whose waits take no time: how long it would have waited is counted."""

import select
from collections.abc import Callable

from mtm_onboard.links import byte_stream


class StalledLine:
    """In the place of the clock and the kernel's waiting; `waited_s` is the sum of all waits.

    After `free_after_s` of them `make_room` is called and the line takes bytes again.
    """

    def __init__(self, free_after_s: float = float("inf"), make_room: Callable[[], None] = lambda: None) -> None:
        self.waited_s = 0.0
        self._free_after_s = free_after_s
        self._make_room = make_room

    def install(self, monkeypatch) -> "StalledLine":
        """Let the links of this test wait here."""
        monkeypatch.setattr(byte_stream, "time", self)
        monkeypatch.setattr(byte_stream, "select", self)
        return self

    def monotonic(self) -> float:
        return self.waited_s

    def select(self, readable, writable, failed, timeout_s):
        if not writable:
            return select.select(readable, writable, failed, timeout_s)
        self.waited_s += timeout_s
        if self.waited_s < self._free_after_s:
            return [], [], []
        self._make_room()
        return [], list(writable), []
