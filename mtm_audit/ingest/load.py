"""Any recording into tracks."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.ingest.films import film_frames
from mtm_audit.model.track import Track
from mtm_audit.readers.motion_capture import read_motion_capture
from mtm_audit.readers.text import check_readable
from mtm_audit.tracking.registry import tracker

VIDEO_SUFFIXES = frozenset(
    {".264", ".265", ".3gp", ".avi", ".h264", ".h265", ".hevc", ".ivf", ".m2ts", ".m4v", ".mjpeg", ".mjpg", ".mkv"}
    | {".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".mxf", ".obu", ".ogv", ".ts", ".vob", ".webm", ".wmv", ".y4m"}
)


def is_video(path: Path) -> bool:
    """By its suffix, or else by its content: text is motion capture, anything else is video.

    Raises MtmError when the file is missing, empty or a folder.
    """
    check_readable(path)
    if path.suffix.lower() in VIDEO_SUFFIXES:
        return True
    with path.open("rb") as file:
        start = file.read(4096)
    return b"\0" in start


def load_tracks(
    path: Path,
    tracker_name: str = "aruco",
    warn: Callable[[str], None] | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Track]:
    """Read one recording: a video through the named tracker, or a motion-capture file as it is.

    `warn` receives one sentence for each thing that is wrong but leaves something to use; `progress` the number of
    frames tracked so far. Raises MtmError when the recording cannot be used.
    """
    if not is_video(path):
        return [read_motion_capture(path)]
    return film_tracks([path], tracker_name, warn, progress)


def film_tracks(
    files: Sequence[Path],
    tracker_name: str = "aruco",
    warn: Callable[[str], None] | None = None,
    progress: Callable[[int], None] | None = None,
    frame_rate_hz: float | None = None,
) -> list[Track]:
    """Follow what moves in one film, in however many files it came; `frame_rate_hz` replaces their times.

    Otherwise as `load_tracks`.
    """
    chosen = tracker(tracker_name)
    frames = film_frames(files, chosen.pixels, warn or (lambda sentence: None), frame_rate_hz)
    return chosen.track(frames, progress)
