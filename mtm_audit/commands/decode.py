"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from mtm_audit.commands.opened_key import KeySource, OpenedKey, opened_key
from mtm_audit.commands.several import run_each
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import at_speed, check_speed, decode_at_speeds, played
from mtm_audit.detectors import make_detector
from mtm_audit.ingest.films import film_compression, film_length
from mtm_audit.ingest.recording import read_recording
from mtm_audit.ingest.source import Source, sources_of
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import StageError, stage
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.stages import Stage, stages_of_decoding, stages_of_recording, text_of_stages
from mtm_audit.reporting.text import print_report
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.key import Key

PIPE_COLUMNS = 140
EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True, kw_only=True)
class DecodeOptions:
    """What the command line asked for; `plot` None draws nothing, `reading` is how to read logs.

    `frame_rate_hz` replaces the times of films; `speed` is how many times as fast the recording is played, None to
    search for it.
    """

    paths: tuple[Path, ...]
    source: KeySource
    tracker: str
    reference: tuple[str, ...]
    settings: DecodeSettings
    as_json: bool
    plot: Path | None
    explain: bool
    reading: ReadOptions = field(default_factory=ReadOptions)
    frame_rate_hz: float | None = None
    speed: float | None = 1.0


def run_decode(options: DecodeOptions) -> int:
    """Decode and report; returns the exit code. Raises MtmError as the parts do, before a result is written.

    Several films are decoded and reported one after the other, and one that cannot be read is told on standard error.
    """
    _check(options)
    stages: list[Stage] = []
    with _explained(options, stages):
        with stage("key"):
            opened = opened_key(options.source, options.settings.revoked)
        key = opened.key
        stages.append(Stage("key", (f"{key.id}, scheme {key.scheme.name} (fingerprint {key.scheme.fingerprint})",)))
        with stage("recording"):
            sources = sources_of(options.paths)
    if len(sources) > 1:
        return run_each(
            sources, options.plot, options.as_json, lambda source: _report(options, opened, source, stages[:1])
        )
    text, code = _report(options, opened, sources[0], stages)
    sys.stdout.write(text)
    return code


def _check(options: DecodeOptions) -> None:
    """Refuse what would fail after the long work."""
    make_detector(options.settings.detector, options.settings.profile)
    tracker(options.tracker)
    check_speed(1.0 if options.speed is None else options.speed)
    if options.plot is not None:
        from mtm_audit.reporting.plot import check_plot_path

        check_plot_path(options.plot)


@contextmanager
def _explained(options: DecodeOptions, stages: Sequence[Stage]) -> Iterator[None]:
    """Where an explanation is asked for, tell the stages that were done before the one that could not go on."""
    try:
        yield
    except StageError as error:
        if options.explain:
            sys.stderr.write(text_of_stages([*stages, Stage(error.stage, (str(error),), failed=True)]))
        raise


def _report(options: DecodeOptions, opened: OpenedKey, source: Source, stages: list[Stage]) -> tuple[str, int]:
    """Decode one recording: what to print of it, and its exit code."""
    with _explained(options, stages):
        recording, decoding = _decode(options, opened, source, stages)
    explanation = ""
    if options.explain:
        explanation = text_of_stages([*stages, *stages_of_decoding(decoding)]) + "\n"
    if options.as_json:
        # Beside JSON the explanation must not get into what a program reads.
        sys.stderr.write(explanation)
        explanation = ""
    return explanation + _publish(options, opened, recording, decoding), EXIT_CODES[decoding.verdict]


def _decode(
    options: DecodeOptions, opened: OpenedKey, source: Source, stages: list[Stage]
) -> tuple[Recording, Decoding]:
    """Run the chain and tell each stage that is done; a refusal names the stage that could not go on."""
    files, kind = source.files, source.kind
    with _progress() as progress:
        with stage("recording"):
            frames = film_length(files) if kind == "video" else None
        if kind == "video":
            stages.append(Stage("recording", (f"video {source.name}, {frames or 'an unknown number of'} frames",)))
        task = progress.add_task(f"tracking {files[0].name}", total=frames, visible=kind == "video")
        with stage("tracks" if kind == "video" else "recording"):
            recording = read_recording(
                files,
                kind,
                options.tracker,
                lambda done: progress.update(task, completed=done),
                options=options.reading,
                frame_rate_hz=options.frame_rate_hz,
                reference=options.reference,
            )
            recording = replace(recording, warnings=(*source.warnings, *recording.warnings))
        progress.remove_task(task)
        stages[1:] = stages_of_recording(recording)
        opened.check_before_public(options.settings.at or recording.at)
        return _read(recording, opened.key, options, progress)


def _read(recording: Recording, key: Key, options: DecodeOptions, progress: Progress) -> tuple[Recording, Decoding]:
    """The decoding, and the recording at the speed at which it was decoded; of a film with its compression.

    That is what may have kept the message from being read, so it is not looked at when it was.
    """
    task = progress.add_task("reading", total=1.0)

    def show(stage: str, fraction: float) -> None:
        progress.update(task, description=stage, completed=fraction)

    given = options.settings.at
    # What a person says of the recording's time comes before what the file says.
    timed = replace(options.settings, at=recording.at if given is None else recording.begun_at(given))
    tracks = recording.tracks
    if options.speed is None:
        speed, decoding = decode_at_speeds(tracks, key, timed, show)
    else:
        speed = options.speed
        decoding = decode_tracks(played(tracks, speed), key, at_speed(timed, tracks, speed), show)
    lost = recording.kind == "video" and decoding.verdict != "decoded"
    shown = replace(
        recording,
        tracks=played(tracks, speed),
        speed=speed,
        speed_searched=options.speed is None,
        compression=film_compression(recording.paths) if lost else None,
    )
    return shown, decoding


def _publish(options: DecodeOptions, opened: OpenedKey, recording: Recording, decoding: Decoding) -> str:
    """Draw what is to be drawn; returns what is to be printed."""
    key_warning = () if opened.key.warning is None else (opened.key.warning,)
    warnings = (*remarks(recording, decoding), *key_warning)
    basis = opened.basis(recording, decoding, stated=options.settings.at is not None)
    if options.plot is not None:
        from mtm_audit.reporting.plot import draw_plot

        draw_plot(recording, decoding, options.plot)
    if options.as_json:
        return json_report(recording, decoding, warnings, basis)
    # In a pipe nobody sees where a line ends, and a cut table cannot be read.
    console = Console(width=None if sys.stdout.isatty() else PIPE_COLUMNS)
    with console.capture() as captured:
        print_report(console, recording, decoding, warnings, basis)
    return captured.get()


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
