"""What a person may see of a watch while it lasts, told by the watch and read from other threads."""

import math
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.live.events import Pose
from mtm_audit.live.judging import Judged
from mtm_audit.model.picture import Frame, Image
from mtm_onboard.protocol.key import Key

_MOST_POINTS, _MOST_NOTICES = 2000, 20

Place = tuple[float, float]
Stage = Literal["watching", "decoded", "over"]


@dataclass(frozen=True)
class Point:
    """The evidence of one look in bits, what looking costs taken off: of any message, and by channel."""

    time_s: float
    bits: float
    channels: Mapping[str, float]


@dataclass(frozen=True)
class Snapshot:
    """A watch at one moment. `needed_bits` is what presence needs, `looks` how many were finished and `weighed` how
    many of them were more than a glance; `places` columns and rows (y down) in the picture, or x and y of poses.
    """

    source: str
    key_id: str
    stage: Stage
    answer: str
    watched_s: float
    seen: int
    looks: int
    weighed: int
    last_look: str
    needed_bits: float
    points: tuple[Point, ...]
    places: Mapping[str, Place]
    notices: tuple[str, ...]
    channels: tuple[str, ...]
    bodies: Mapping[str, str]


@dataclass
class WatchState:
    """Hears what the watch tells (`Audience`) and gives snapshots of it, from any thread."""

    source: str
    key: Key
    threshold: float
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _points: deque[Point] = field(default_factory=lambda: deque(maxlen=_MOST_POINTS))
    _notices: deque[str] = field(default_factory=lambda: deque(maxlen=_MOST_NOTICES))
    _places: dict[str, Place] = field(default_factory=dict)
    _image: Image | None = None
    _stage: Stage = "watching"
    _answer: str = "nothing found yet"
    _last_look: str = "none yet"
    _watched_s: float = 0.0
    _seen: int = 0
    _looks: int = 0
    _weighed: int = 0
    _bodies: dict[str, str] = field(default_factory=dict)

    def shown(self, event: Frame | Pose, watched_s: float, places: Mapping[str, Place] | None = None) -> None:
        """Something was seen; `places` is where things are in a frame."""
        with self._lock:
            self._watched_s = watched_s
            self._seen += 1
            if isinstance(event, Pose):
                self._places[event.name] = (event.x, event.y)
            else:
                self._image, self._places = event.image, dict(places or {})

    def noticed(self, sentence: str) -> None:
        """Something happened that a person should know."""
        with self._lock:
            self._notices.append(sentence)

    def judged(self, judged: Judged) -> None:
        """A look was finished."""
        with self._lock:
            self._looks += 1
            decoding = judged.decoding
            self._last_look = f"at {judged.look.until_s:.1f} s: {_outcome(judged)}"
            if decoding is None:
                return
            self._weighed += 1
            self._points.append(_point(judged.look.until_s, decoding))
            self._answer = _ANSWERS[decoding.verdict]
            self._bodies = {
                channel.channel.body: channel.glimpse.name for channel in decoding.channels if channel.glimpse
            }

    def finished(self, sentence: str, *, decoded: bool) -> None:
        """The watch is over, with that verdict."""
        with self._lock:
            self._answer, self._stage = sentence, "decoded" if decoded else "over"

    def snapshot(self) -> Snapshot:
        """How it stands."""
        with self._lock:
            return Snapshot(
                source=self.source,
                key_id=self.key.id,
                stage=self._stage,
                answer=self._answer,
                watched_s=self._watched_s,
                seen=self._seen,
                looks=self._looks,
                weighed=self._weighed,
                last_look=self._last_look,
                needed_bits=-math.log2(self.threshold),
                points=tuple(self._points),
                places=dict(self._places),
                notices=tuple(self._notices),
                channels=tuple(channel.name for channel in self.key.scheme.channels),
                bodies=dict(self._bodies),
            )

    def picture(self) -> tuple[Image | None, dict[str, Place], dict[str, int]]:
        """The newest picture, None before the first and of poses; where things are in it, and the number of each.

        What shows a channel has the channel's number, once that is known.
        """
        with self._lock:
            shown = {track: number for number, channel in enumerate(self.key.scheme.channels)
                     if (track := self._bodies.get(channel.body)) is not None}  # fmt: skip
            numbers = {name: shown.get(name, number) for number, name in enumerate(sorted(self._places))}
            return self._image, dict(self._places), numbers


_ANSWERS = {
    "decoded": "decoded",
    "inconclusive": "a message of this key is there; not all of it is read yet",
    "absent": "nothing found yet",
}


def _outcome(judged: Judged) -> str:
    if judged.refusal is not None:
        return judged.refusal
    if judged.decoding is None:
        return "a glance shows nothing"
    return f"{judged.decoding.evidence.bits:.1f} bits"


def _point(time_s: float, decoding: Decoding) -> Point:
    nats = {channel.channel.name: channel.nats for channel in decoding.channels}
    channels = {name: value / math.log(2.0) for name, value in nats.items() if value is not None}
    return Point(time_s, decoding.evidence.bits, channels)
