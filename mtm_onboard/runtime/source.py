"""Where base commands come from. A source holds the newest one and when it arrived; older ones are forgotten."""

import math
import os
import select
from abc import ABC, abstractmethod
from typing import NamedTuple

from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.base_command import LONGEST_BYTES, StopRequest, parse

# One tick reads no more than this, so that a flood of commands cannot hold up the loop.
_MOST_READS = 256
# After a longer pause between two polls a command may be as old as the pause, so it counts as that old.
_LONGEST_PAUSE_S = 0.25


class Command(NamedTuple):
    """The newest base velocity, its arrival on the runtime's clock, and whether the operator ever said stop."""

    velocity: BodyVelocity
    arrived_s: float
    stop: bool


NOTHING_YET = Command(STOP, -math.inf, False)


class Source(ABC):
    """A place that base commands come from.

    `refused` counts input that was malformed, oversized or non-finite. Where several may send, `sender` is who drives
    the robot, `intrusions` counts the commands of others, the latest of them being `intruder`, and `lost` what the
    system dropped; else they stay as they are here. `stop_reason` says why a command has a stop.
    """

    refused = 0
    sender = ""
    intruder = ""
    intrusions = 0
    lost = 0
    stop_reason = "the operator said stop"

    @abstractmethod
    def poll(self, now_s: float) -> Command:
        """Take in what has come and return the newest command; never waits."""

    def close(self) -> None:  # noqa: B027 - most sources hold nothing
        """Release what the source holds."""


class HeldSource(Source):
    """Commands set by the controller in the same process."""

    def __init__(self) -> None:
        self._newest = NOTHING_YET

    def set(self, velocity: BodyVelocity, now_s: float) -> None:
        """Replace the base command; `now_s` is on the runtime's clock."""
        self._newest = Command(velocity, now_s, self._newest.stop)

    def stop(self) -> None:
        """Say the operator's stop."""
        self._newest = self._newest._replace(stop=True)

    def poll(self, now_s: float) -> Command:
        """The command set last."""
        return self._newest


class TextSource(Source):
    """Takes in texts in the format of `base_command`."""

    def __init__(self) -> None:
        self._newest = NOTHING_YET
        self._polled_s = -math.inf

    def _arrival_s(self, now_s: float) -> float:
        before_s, self._polled_s = self._polled_s, now_s
        return now_s if now_s - before_s <= _LONGEST_PAUSE_S else before_s

    def _take(self, text: bytes, arrived_s: float) -> None:
        try:
            command = parse(text)
        except MtmError:
            self.refused += 1
            return
        if isinstance(command, StopRequest):
            self._newest = self._newest._replace(stop=True)
        else:
            self._newest = Command(command, arrived_s, self._newest.stop)


class StdinSource(TextSource):
    """One command a line from a file descriptor, standard input by default. Its end leaves the last command to age."""

    def __init__(self, descriptor: int = 0) -> None:
        super().__init__()
        self._descriptor = descriptor
        self._begun = b""
        self._overlong = False
        self._ended = False

    def poll(self, now_s: float) -> Command:
        """Read the lines that are there; the last good one wins."""
        arrived_s = self._arrival_s(now_s)
        for _ in range(_MOST_READS):
            data = self._read()
            if not data:
                break
            self._split(data, arrived_s)
        return self._newest

    def _read(self) -> bytes:
        try:
            if self._ended or not select.select([self._descriptor], [], [], 0)[0]:
                return b""
            data = os.read(self._descriptor, 4096)
        except OSError:
            # A descriptor that was never open, or a terminal that is gone: the same as its end.
            data = b""
        self._ended = not data
        return data

    def _split(self, data: bytes, arrived_s: float) -> None:
        *lines, self._begun = (self._begun + data).split(b"\n")
        for line in lines:
            if self._overlong:
                self._overlong = False
            else:
                self._take(line, arrived_s)
        if len(self._begun) > LONGEST_BYTES:
            self.refused += not self._overlong
            self._begun = b""
            self._overlong = True
