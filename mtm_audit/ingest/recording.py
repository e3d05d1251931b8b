"""The files of a recording into its tracks."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.ingest.load import is_video, load_tracks
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Kind, Recording
from mtm_audit.model.track import Track
from mtm_audit.readers.video import inspect_video
from mtm_onboard.protocol.errors import MtmError

# Times from here on, the year 2001, count from the Unix epoch.
_EARLIEST_UNIX_S = 1e9
_MOTION_CAPTURE_SUFFIXES = frozenset({".csv", ".tum", ".txt"})


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
    files: tuple[Path, ...],
    kind: Kind,
    tracker: str = "aruco",
    progress: Callable[[int], None] | None = None,
    reference: Sequence[str] = (),
) -> Recording:
    """Read the files into tracks; `progress` receives the number of frames tracked so far.

    `reference` names tracks of a video that stand still; the camera's own motion is taken out. Raises MtmError when a
    file cannot be used, or when two files are of one body.
    """
    warnings: list[str] = []
    tracks: list[Track] = []
    for file in files:
        tracks += load_tracks(file, tracker, warnings.append, progress, reference)
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"two files are of the body {twice!r}; leave one out or rename it")
    return Recording(files, kind, tuple(tracks), tuple(warnings), _recorded_at(files, kind, tracks))


def _recorded_at(files: Sequence[Path], kind: Kind, tracks: Sequence[Track]) -> RecordedAt | None:
    """A video's creation time; motion capture whose times are those since the Unix epoch says it by itself."""
    if kind == "video":
        created_s = inspect_video(files[0]).created_unix_s
        return None if created_s is None else RecordedAt(created_s)
    first_s = min((float(track.times_s[0]) for track in tracks if len(track.times_s)), default=0.0)
    return RecordedAt(0.0) if first_s > _EARLIEST_UNIX_S else None


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
