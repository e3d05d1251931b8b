"""Pose streams: lines of text, one pose each, over UDP or in a growing file; and the tracks that they make.

A line is `name,time_s,x,y` or `name,time_s,x,y,heading_rad`; docs/watch.md has the format.
"""

import math
import socket
import time
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mtm_audit.live.events import Event, Notice, Pose, Quiet
from mtm_audit.live.timeline import Timeline
from mtm_audit.model.track import FARTHEST, Track
from mtm_onboard.protocol.errors import MtmError

MOST_BODIES = 64
_LONGEST_NAME = 64
_LARGEST_DATAGRAM = 65_535
_QUIET_S = 0.2


def parse_pose(line: str) -> Pose:
    """The pose in one line, its time by the sender's clock; raises ValueError for anything else."""
    name, *words = (word.strip() for word in line.split(","))
    if not 0 < len(name) <= _LONGEST_NAME or not name.isprintable():
        raise ValueError("a name of 1 to 64 letters is missing")
    if len(words) not in (3, 4):
        raise ValueError("name,time_s,x,y or name,time_s,x,y,heading_rad is wanted")
    time_s, x, y, *turn = (float(word) for word in words)
    if not math.isfinite(time_s):
        raise ValueError("the time is no number")
    if max(abs(x), abs(y)) > FARTHEST:
        raise ValueError("the position is too far away")
    if math.isnan(x) or math.isnan(y):
        x = y = math.nan
    return Pose(name, time_s, x, y, turn[0] if turn and math.isfinite(turn[0]) else math.nan)


@dataclass
class PoseLines:
    """Turns lines into poses at times of the watch, and tells once what is wrong with some."""

    timeline: Timeline
    source: str
    _last_s: dict[str, float] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)

    def events(self, lines: Iterable[str], arrival_s: float) -> Iterator[Event]:
        """The poses of lines that arrived then; empty lines and comments are none."""
        for line in lines:
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            try:
                pose = parse_pose(line)
            except ValueError as error:
                yield from self._once("line", f"{self.source} sends lines that are no poses ({error}); they are "
                                              "left out")  # fmt: skip
                continue
            time_s = self.timeline.offset_s(pose.time_s, arrival_s) + pose.time_s
            if pose.name not in self._last_s and len(self._last_s) >= MOST_BODIES:
                yield from self._once("bodies", f"{self.source} names more than {MOST_BODIES} bodies; the others are "
                                                "left out")  # fmt: skip
            elif time_s <= self._last_s.get(pose.name, -math.inf):
                yield from self._once("order", f"{self.source} sends poses whose times do not rise; those are left "
                                               "out")  # fmt: skip
            else:
                self._last_s[pose.name] = time_s
                yield Pose(pose.name, time_s, pose.x, pose.y, pose.heading_rad)

    def _once(self, kind: str, sentence: str) -> Iterator[Event]:
        if kind not in self._told:
            self._told.add(kind)
            yield Notice(sentence)


def udp_poses(host: str, port: int, source: str, clock: Callable[[], float] = time.monotonic) -> Iterator[Event]:
    """What is sent to that address, for ever; raises MtmError when nothing can be received there."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        receiver = socket.socket(family, socket.SOCK_DGRAM)
        try:
            receiver.bind(address)
        except OSError:
            receiver.close()
            raise
    except OSError as error:
        raise MtmError(
            f"cannot receive at {source}: {error.strerror}; choose an address of this machine and a free port"
        ) from error
    with receiver:
        receiver.settimeout(_QUIET_S)
        lines = PoseLines(Timeline(), source)
        while True:
            try:
                data = receiver.recv(_LARGEST_DATAGRAM)
            except TimeoutError:
                yield Quiet()
                continue
            yield from lines.events(data.decode("utf-8", "replace").splitlines(), clock())


@dataclass
class PoseTracks:
    """The tracks of what was sent so far."""

    _rows: dict[str, list[tuple[float, float, float, float]]] = field(default_factory=dict)

    def put(self, pose: Pose) -> None:
        """Note a pose; times of one body rise."""
        self._rows.setdefault(pose.name, []).append((pose.time_s, pose.x, pose.y, pose.heading_rad))

    def tracks(self) -> list[Track]:
        """One track per body, in the order of their names; headings where all that was seen has one."""
        return [_track(name, np.array(rows)) for name, rows in sorted(self._rows.items())]

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then, and bodies that were not seen since."""
        for rows in self._rows.values():
            del rows[: bisect_left(rows, (before_s,))]
        self._rows = {name: rows for name, rows in self._rows.items() if rows}


def _track(name: str, table: np.ndarray) -> Track:
    valid = np.isfinite(table[:, 1:3]).all(axis=1)
    turned = bool(np.isfinite(table[valid, 3]).any())
    return Track(name, table[:, 0], table[:, 1:3], valid, headings_rad=table[:, 3] if turned else None)
