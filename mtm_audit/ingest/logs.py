"""Logs and motion capture of one recording: what a folder holds of them, and several files on one clock."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_audit.readers.formats.rosbag import bag_files, is_bag_folder
from mtm_audit.readers.logs.opening import opening_of
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import Contents, format_of, read_log
from mtm_onboard.protocol.errors import MtmError

# Files that are meant to be recordings, so that one that cannot be read is told of.
_RECORDING_SUFFIXES = frozenset({
    ".csv", ".tum", ".tsv", ".c3d", ".bag", ".db3", ".mcap", ".ulg", ".bin", ".tlog", ".parquet",
})  # fmt: skip


def log_files(folder: Path, warn: Callable[[str], None] | None = None) -> list[Path]:
    """The logs in a folder by name, which for a bag of ROS 2 is the folder itself; `warn` is told what was left out."""
    found: list[Path] = []
    try:
        paths = sorted(path for path in folder.iterdir() if path.is_file())
    except OSError as error:
        raise MtmError(f"{folder} cannot be read ({error.strerror}); check its permissions") from error
    if is_bag_folder(folder):
        found.append(folder)
        inside = bag_files(folder)
        paths = [path for path in paths if path not in inside]
    for path in paths:
        if _is_log(path):
            found.append(path)
        elif warn is not None and path.suffix.lower() in _RECORDING_SUFFIXES:
            warn(f"{path} is of no format that is read, and was left out")
    return found


def read_logs(files: Sequence[Path], options: ReadOptions, warn: Callable[[str], None]) -> Contents:
    """The tracks of all files; those whose clocks are known in Unix time are put on the clock of the first.

    Raises MtmError when one cannot be used.
    """
    logs = [read_log(file, options, warn) for file in files]
    first = logs[0].at
    if len(logs) == 1 or first is None or any(log.at is None for log in logs):
        return Contents(tuple(track for log in logs for track in log.tracks), first if len(logs) == 1 else None)
    tracks = tuple(moved for log in logs for moved in _moved(log, first))
    return Contents(tracks, RecordedAt(first.unix_s, max(log.at.error_s for log in logs if log.at is not None)))


def _moved(log: Contents, first: RecordedAt) -> tuple[Track, ...]:
    assert log.at is not None
    later_s = log.at.unix_s - first.unix_s
    return log.tracks if later_s == 0.0 else tuple(replace(t, times_s=t.times_s + later_s) for t in log.tracks)


def _is_log(path: Path) -> bool:
    """Whether a file in a folder is a log; one that cannot be opened is none."""
    try:
        return path.stat().st_size > 0 and format_of(opening_of(path)) is not None
    except (OSError, MtmError):
        return False
