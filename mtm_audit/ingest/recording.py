"""The files of a recording into its tracks."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.ingest.load import is_video, load_tracks
from mtm_audit.ingest.logs import log_files, read_logs
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Kind, Recording
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.video import inspect_video
from mtm_onboard.protocol.errors import MtmError


def recording_files(paths: Sequence[Path], warn: Callable[[str], None] | None = None) -> tuple[tuple[Path, ...], Kind]:
    """The files behind `paths` and what they are: one video, or logs and motion capture, a folder standing for its own.

    `warn` is told what a folder holds that cannot be read. Raises MtmError when a file is missing or empty, a folder
    holds no log, or videos come with others.
    """
    files = tuple(file for path in paths for file in (_folder_files(path, warn) if path.is_dir() else [path]))
    videos = [file for file in files if not file.is_dir() and is_video(file)]
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
    options: ReadOptions | None = None,
) -> Recording:
    """Read the files into tracks; `progress` receives the number of frames tracked so far, `options` are of logs.

    Raises MtmError when one cannot be used, or when two files are of one body.
    """
    warnings: list[str] = []
    if kind == "video":
        tracks = load_tracks(files[0], tracker, warnings.append, progress)
        at = _created_at(files[0])
    else:
        contents = read_logs(files, options or ReadOptions(), warnings.append)
        tracks, at = list(contents.tracks), contents.at
    _check_names(tracks)
    return Recording(files, kind, tuple(tracks), tuple(warnings), at)


def _check_names(tracks: Sequence[Track]) -> None:
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"two files are of the body {twice!r}; leave one out or rename it")


def _created_at(path: Path) -> RecordedAt | None:
    created_s = inspect_video(path).created_unix_s
    return None if created_s is None else RecordedAt(created_s)


def _folder_files(folder: Path, warn: Callable[[str], None] | None) -> list[Path]:
    files = log_files(folder, warn)
    if not files:
        raise MtmError(
            f"the folder {folder} holds no log or motion capture of a format that is read (docs/formats.md); name such "
            "a folder, its files, or a video"
        )
    return files
