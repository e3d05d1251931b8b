"""A whole recording, however many files it came in."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from mtm_audit.model.compression import Compression
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track

Kind = Literal["video", "motion capture"]


@dataclass(frozen=True)
class Recording:
    """What was recorded: the files, their tracks, and one sentence for each thing that was wrong but usable.

    `at` is when the files say that they were recorded, None when they do not. `speed` is how many times as fast as the
    files say it is played here, which was given, or found among others when `speed_searched`. `compression` is that of
    a film, where it was asked for. `pictured` are the tracks of a film as its pictures show them, in the
    file's time. `together` names all recordings that were read together with this one, in order.
    """

    paths: tuple[Path, ...]
    kind: Kind
    tracks: tuple[Track, ...]
    warnings: tuple[str, ...] = ()
    at: RecordedAt | None = None
    speed: float = 1.0
    speed_searched: bool = False
    compression: Compression | None = None
    together: tuple[str, ...] = ()
    pictured: Pictured | None = None

    def begun_at(self, begun: RecordedAt) -> RecordedAt:
        """When the recording's own clock stood at zero, if its first observation was made at `begun.unix_s`."""
        return replace(begun, unix_s=begun.unix_s - self._first_s)

    @property
    def _first_s(self) -> float:
        return min(float(track.times_s[0]) for track in self.tracks)

    @property
    def frames(self) -> int:
        """Frames of the video, or samples of the longest motion-capture track."""
        return max(len(track.times_s) for track in self.tracks)

    @property
    def duration_s(self) -> float:
        """From the first observation of any track to the last."""
        return max(float(track.times_s[-1]) for track in self.tracks) - self._first_s

    @property
    def frame_rate_hz(self) -> float | None:
        """Frames or samples per second of the slowest track, by the median interval; None when a single one is all."""
        intervals_s = [float(np.median(np.diff(track.times_s))) for track in self.tracks if len(track.times_s) > 1]
        return 1.0 / max(intervals_s) if intervals_s else None
