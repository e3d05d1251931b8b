"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from mtm_audit.decoding.decode import DecodeSettings, Decoding, decode_tracks
from mtm_audit.detectors import make_detector
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.model.recording import Recording
from mtm_audit.readers.video import inspect_video
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.stages import Stage, failed_stage, stages_of_decoding, stages_of_recording, text_of_stages
from mtm_audit.reporting.text import print_report
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key, load_key

_PIPE_COLUMNS = 140
EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True)
class DecodeOptions:
    """What the command line asked for; `plot` None draws nothing."""

    paths: tuple[Path, ...]
    key: Path
    tracker: str
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
    except MtmError as error:
        if options.explain:
            stages[-1] = Stage(stages[-1].name, (str(error),), failed=True)
            sys.stderr.write(text_of_stages(stages))
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
    """Run the chain; when a part raises, the last of `stages` is the one that failed."""
    stages.append(Stage("key", ("",)))
    key = load_key(options.key)
    stages[-1] = Stage("key", (f"{key.id}, scheme {key.scheme.name} (fingerprint {key.scheme.fingerprint})",))
    stages.append(Stage("recording", ("",)))
    files, kind = recording_files(options.paths)
    with _progress() as progress:
        frames = inspect_video(files[0]).frame_count if kind == "video" else None
        if kind == "video":
            stages[-1] = Stage("recording", (f"video {files[0]}, {frames or 'an unknown number of'} frames",))
            stages.append(Stage("tracks", ("",)))
        task = progress.add_task(f"tracking {files[0].name}", total=frames, visible=kind == "video")
        recording = read_recording(files, kind, options.tracker, lambda done: progress.update(task, completed=done))
        progress.remove_task(task)
        stages[1:] = stages_of_recording(recording)
        try:
            return recording, _read(recording, key, options.settings, progress)
        except MtmError:
            failed = failed_stage(recording.tracks, key.scheme, options.settings)
            if failed != stages[-1].name:
                stages.append(Stage(failed, ("",)))
            raise


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
