"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors import make_detector
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import StageError, stage
from mtm_audit.readers.video import inspect_video
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.stages import Stage, stages_of_decoding, stages_of_recording, text_of_stages
from mtm_audit.reporting.text import print_report
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.key import Key, load_key

_PIPE_COLUMNS = 140
EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True)
class DecodeOptions:
    """What the command line asked for; `plot` None draws nothing."""

    paths: tuple[Path, ...]
    key: Path
    tracker: str
    reference: tuple[str, ...]
    settings: DecodeSettings
    as_json: bool
    plot: Path | None
    explain: bool


def run_decode(options: DecodeOptions) -> int:
    """Decode and report; returns the exit code. Raises MtmError as the parts do, before a result is written."""
    _check(options)
    stages: list[Stage] = []
    try:
        recording, decoding = _decode(options, stages)
    except StageError as error:
        if options.explain:
            sys.stderr.write(text_of_stages([*stages, Stage(error.stage, (str(error),), failed=True)]))
        raise
    if options.explain:
        # Beside JSON the explanation must not get into what a program reads.
        stream = sys.stderr if options.as_json else sys.stdout
        stream.write(text_of_stages([*stages, *stages_of_decoding(decoding)]) + "\n")
    _publish(options, recording, decoding)
    return EXIT_CODES[decoding.verdict]


def _check(options: DecodeOptions) -> None:
    """Refuse what would fail after the long work."""
    make_detector(options.settings.detector, options.settings.profile)
    tracker(options.tracker)
    if options.plot is not None:
        from mtm_audit.reporting.plot import check_plot_path

        check_plot_path(options.plot)


def _decode(options: DecodeOptions, stages: list[Stage]) -> tuple[Recording, Decoding]:
    """Run the chain and tell each stage that is done; a refusal names the stage that could not go on."""
    with stage("key"):
        key = load_key(options.key)
    stages.append(Stage("key", (f"{key.id}, scheme {key.scheme.name} (fingerprint {key.scheme.fingerprint})",)))
    with _progress() as progress:
        with stage("recording"):
            files, kind = recording_files(options.paths)
            frames = inspect_video(files[0]).frame_count if kind == "video" else None
        if kind == "video":
            stages.append(Stage("recording", (f"video {files[0]}, {frames or 'an unknown number of'} frames",)))
        task = progress.add_task(f"tracking {files[0].name}", total=frames, visible=kind == "video")
        with stage("tracks" if kind == "video" else "recording"):
            recording = read_recording(
                files, kind, options.tracker, lambda done: progress.update(task, completed=done), options.reference
            )
        progress.remove_task(task)
        stages[1:] = stages_of_recording(recording)
        return recording, _read(recording, key, options.settings, progress)


def _read(recording: Recording, key: Key, settings: DecodeSettings, progress: Progress) -> Decoding:
    task = progress.add_task("reading", total=1.0)

    def show(stage: str, fraction: float) -> None:
        progress.update(task, description=stage, completed=fraction)

    # What a person says of the recording's time comes before what the file says.
    timed = settings if settings.at is not None else replace(settings, at=recording.at)
    return decode_tracks(recording.tracks, key, timed, show)


def _publish(options: DecodeOptions, recording: Recording, decoding: Decoding) -> None:
    warnings = remarks(recording, decoding)
    if options.plot is not None:
        from mtm_audit.reporting.plot import draw_plot

        draw_plot(recording, decoding, options.plot)
    if options.as_json:
        sys.stdout.write(json_report(recording, decoding, warnings))
    else:
        # In a pipe nobody sees where a line ends, and a cut table cannot be read.
        print_report(Console(width=None if sys.stdout.isatty() else _PIPE_COLUMNS), recording, decoding, warnings)


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
