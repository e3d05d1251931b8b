"""A whole recording, however many files it came in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mtm_audit.recordings.load import is_video, load_tracks
from mtm_audit.tracks import Track
from mtm_onboard.protocol.errors import MtmError

Kind = Literal["video", "motion capture"]
_MOTION_CAPTURE_SUFFIXES = frozenset({".csv", ".tum", ".txt"})


@dataclass(frozen=True)
class Recording:
    """What was recorded: the files, their tracks, and one sentence for each thing that was wrong but usable."""

    paths: tuple[Path, ...]
    kind: Kind
    tracks: tuple[Track, ...]
    warnings: tuple[str, ...] = ()

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


def recording_files(paths: Sequence[Path]) -> tuple[tuple[Path, ...], Kind]:
    """The files behind `paths` and what they are: one video, or motion-capture files, a folder standing for its files.

    Raises MtmError when a file is missing or empty, a folder holds no motion capture, or videos come with others.
    """
    files = tuple(file for path in paths for file in (_folder_files(path) if path.is_dir() else [path]))
    videos = [file for file in files if is_video(file)]
    if not videos:
        return files, "motion capture"
    if len(files) > 1:
        raise MtmError(f"{videos[0]} is a video and not alone; decode one video at a time")
    return files, "video"


def read_recording(
    files: tuple[Path, ...], kind: Kind, tracker: str = "aruco", progress: Callable[[int], None] | None = None
) -> Recording:
    """Read the files into tracks; `progress` receives the number of frames tracked so far.

    Raises MtmError when one cannot be used, or when two files are of one body.
    """
    warnings: list[str] = []
    tracks: list[Track] = []
    for file in files:
        tracks += load_tracks(file, tracker, warnings.append, progress)
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"two files are of the body {twice!r}; leave one out or rename it")
    return Recording(files, kind, tuple(tracks), tuple(warnings))


def _folder_files(folder: Path) -> list[Path]:
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() in _MOTION_CAPTURE_SUFFIXES)
    except OSError as error:
        raise MtmError(f"{folder} cannot be read ({error.strerror}); check its permissions") from error
    if not files:
        raise MtmError(
            f"the folder {folder} holds no motion-capture file (.tum, .csv or .txt); name such a folder or a video"
        )
    return files
