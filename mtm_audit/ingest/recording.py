"""The files of a recording into its tracks."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.ingest.films import is_picture
from mtm_audit.ingest.load import film_tracks, load_tracks
from mtm_audit.ingest.source import sources_of
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Kind, Recording
from mtm_audit.model.track import Track
from mtm_audit.readers.video import inspect_video
from mtm_onboard.protocol.errors import MtmError

# Times from here on, the year 2001, count from the Unix epoch.
_EARLIEST_UNIX_S = 1e9


def recording_files(paths: Sequence[Path]) -> tuple[tuple[Path, ...], Kind]:
    """The files behind `paths`, which are one recording, and what they are; a folder stands for what it holds.

    Raises MtmError as `sources_of` does, and when there are several films.
    """
    source, *others = sources_of(paths)
    if others:
        raise MtmError(f"{source.name} and {others[0].name} are different films; decode one at a time")
    return source.files, source.kind


def read_recording(
    files: tuple[Path, ...],
    kind: Kind,
    tracker: str = "aruco",
    progress: Callable[[int], None] | None = None,
    frame_rate_hz: float | None = None,
) -> Recording:
    """Read the files into tracks; `progress` receives the number of frames tracked so far.

    `frame_rate_hz` replaces the times of a film by even ones. Raises MtmError when a file cannot be used, or when two
    files are of one body.
    """
    warnings: list[str] = []
    tracks: list[Track] = []
    if kind == "video":
        tracks = film_tracks(files, tracker, warnings.append, progress, frame_rate_hz)
    else:
        for file in files:
            tracks += load_tracks(file, tracker, warnings.append, progress)
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"two files are of the body {twice!r}; leave one out or rename it")
    return Recording(files, kind, tuple(tracks), tuple(warnings), _recorded_at(files, kind, tracks))


def _recorded_at(files: Sequence[Path], kind: Kind, tracks: Sequence[Track]) -> RecordedAt | None:
    """A video's creation time is that of its first frame; times since the Unix epoch say it by themselves."""
    first_s = min((float(track.times_s[0]) for track in tracks if len(track.times_s)), default=0.0)
    if first_s > _EARLIEST_UNIX_S:
        return RecordedAt(0.0)
    if kind != "video" or files[0].is_dir() or is_picture(files[0]):
        return None
    created_s = inspect_video(files[0]).created_unix_s
    return None if created_s is None else RecordedAt(created_s - first_s)
