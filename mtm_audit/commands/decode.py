"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from mtm_audit.decode import DecodeSettings, Decoding, decode_tracks
from mtm_audit.jsonreport import json_report
from mtm_audit.recordings.recording import Kind, Recording, read_recording, recording_files
from mtm_audit.recordings.video import inspect_video
from mtm_audit.remarks import remarks
from mtm_audit.report import print_report
from mtm_onboard.protocol.key import Key, load_key

_PIPE_COLUMNS = 140
EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True)
class DecodeOptions:
    """What the command line asked for."""

    paths: tuple[Path, ...]
    key: Path
    tracker: str
    settings: DecodeSettings
    as_json: bool


def run_decode(options: DecodeOptions) -> int:
    """Decode and report; returns the exit code. Raises MtmError as the parts do, before anything is written."""
    key = load_key(options.key)
    files, kind = recording_files(options.paths)
    with _progress() as progress:
        recording = _read(files, kind, options.tracker, progress)
        decoding = _decode(recording, key, options.settings, progress)
    warnings = remarks(recording, decoding)
    if options.as_json:
        sys.stdout.write(json_report(recording, decoding, warnings))
    else:
        # In a pipe nobody sees where a line ends, and a cut table cannot be read.
        print_report(Console(width=None if sys.stdout.isatty() else _PIPE_COLUMNS), recording, decoding, warnings)
    return EXIT_CODES[decoding.verdict]


def _read(files: tuple[Path, ...], kind: Kind, tracker: str, progress: Progress) -> Recording:
    frames = inspect_video(files[0]).frame_count if kind == "video" else None
    task = progress.add_task(f"tracking {files[0].name}", total=frames, visible=kind == "video")
    recording = read_recording(files, kind, tracker, lambda done: progress.update(task, completed=done))
    progress.remove_task(task)
    return recording


def _decode(recording: Recording, key: Key, settings: DecodeSettings, progress: Progress) -> Decoding:
    task = progress.add_task("reading", total=1.0)

    def show(stage: str, fraction: float) -> None:
        progress.update(task, description=stage, completed=fraction)

    return decode_tracks(recording.tracks, key, settings, show)


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
