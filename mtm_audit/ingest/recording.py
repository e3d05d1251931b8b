"""From paths to a recording: tracks, and when they were made."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mtm_audit.ingest.films import film_frames, is_picture
from mtm_audit.ingest.load import tracked
from mtm_audit.ingest.logs import read_logs
from mtm_audit.ingest.source import sources_of
from mtm_audit.model.lens import Lens
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Kind, Recording
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.video import inspect_video
from mtm_audit.tracking.registry import tracker as tracker_named
from mtm_onboard.protocol.errors import MtmError


def recording_files(paths: Sequence[Path], warn: Callable[[str], None] | None = None) -> tuple[tuple[Path, ...], Kind]:
    """The files behind `paths`, which are one recording, and what they are; a folder stands for what it holds.

    `warn` is told what a folder holds that cannot be read. Raises MtmError as `sources_of` does, and when there are
    several films.
    """
    source, *others = sources_of(paths)
    if others:
        raise MtmError(f"{source.name} and {others[0].name} are different films; decode one at a time")
    if warn is not None:
        for warning in source.warnings:
            warn(warning)
    return source.files, source.kind


def read_recording(
    files: Sequence[Path],
    kind: Kind,
    tracker: str = "aruco",
    progress: Callable[[int], None] | None = None,
    *,
    options: ReadOptions | None = None,
    frame_rate_hz: float | None = None,
    reference: Sequence[str] = (),
    lens: Lens | None = None,
) -> Recording:
    """Read the files into tracks; `progress` receives the number of frames tracked so far, `options` are of logs.

    `frame_rate_hz` replaces the times of a film by even ones, and `reference` names tracks of a film that stand still;
    what the film's `lens` distorts is straightened, and the camera's own motion is taken out. Raises MtmError when a
    file cannot be used, or when two files are of one body.
    """
    warnings: list[str] = []
    kept: list[Pictured] = []
    if kind == "video":
        frames = film_frames(files, tracker_named(tracker).pixels, warnings.append, frame_rate_hz)
        tracks = tracked(frames, tracker, reference, warnings.append, progress, kept.append, lens)
        at = _created_at(files, tracks)
    else:
        contents = read_logs(files, options or ReadOptions(), warnings.append)
        tracks, at = list(contents.tracks), contents.at
    _check_names(tracks)
    return Recording(tuple(files), kind, tuple(tracks), tuple(warnings), at, pictured=kept[0] if kept else None)


def _check_names(tracks: Sequence[Track]) -> None:
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"two files are of the body {twice!r}; leave one out or rename it")


def _created_at(files: Sequence[Path], tracks: Sequence[Track]) -> RecordedAt | None:
    """A video's creation time is that of its first frame."""
    if files[0].is_dir() or is_picture(files[0]):
        return None
    created_s = inspect_video(files[0]).created_unix_s
    first_s = min((float(track.times_s[0]) for track in tracks if len(track.times_s)), default=0.0)
    return None if created_s is None else RecordedAt(created_s - first_s)
