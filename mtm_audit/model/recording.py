"""A whole recording, however many files it came in."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track

Kind = Literal["video", "motion capture"]


@dataclass(frozen=True)
class Recording:
    """What was recorded: the files, their tracks, and one sentence for each thing that was wrong but usable.

    `at` is when the files say that they were recorded, None when they do not.
    """

    paths: tuple[Path, ...]
    kind: Kind
    tracks: tuple[Track, ...]
    warnings: tuple[str, ...] = ()
    at: RecordedAt | None = None

    @property
    def frames(self) -> int:
        """Frames of the video, or samples of the longest motion-capture track."""
        return max(len(track.times_s) for track in self.tracks)

    @property
    def duration_s(self) -> float:
        """From the first observation of any track to the last."""
        first_s = min(float(track.times_s[0]) for track in self.tracks)
        return max(float(track.times_s[-1]) for track in self.tracks) - first_s

    @property
    def frame_rate_hz(self) -> float | None:
        """Frames or samples per second of the slowest track, by the median interval; None when a single one is all."""
        intervals_s = [float(np.median(np.diff(track.times_s))) for track in self.tracks if len(track.times_s) > 1]
        return 1.0 / max(intervals_s) if intervals_s else None
