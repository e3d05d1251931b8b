"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from mtm_audit.commands.console import answer_console
from mtm_audit.commands.decode_values import check_decode_values
from mtm_audit.commands.opened_key import KeySource, OpenedKey, opened_key
from mtm_audit.commands.several import check_together, run_each
from mtm_audit.commands.unused import unused_options
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.readings import Progress as ReadingProgress
from mtm_audit.decoding.recorded import decode_recording, recorded_of
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.together import decode_together
from mtm_audit.ingest.films import film_length
from mtm_audit.ingest.recording import read_recording
from mtm_audit.ingest.source import Source, recordings_of, sources_of
from mtm_audit.model.lens import Lens
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import StageError, stage
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.overlay.files import OverlayFiles, check_pictures, draw_overlay
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.report.provenance import ReportRequest
from mtm_audit.reporting.stages import Stage, stages_of_decoding, stages_of_recording, text_of_stages
from mtm_audit.reporting.text import print_report
from mtm_onboard.protocol.disclosure import save_disclosed
from mtm_onboard.protocol.output_file import check_new_file, check_outputs

EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True, kw_only=True)
class DecodeOptions:
    """What the command line asked for; `plot` None draws nothing, `reading` is how to read logs.

    `frame_rate_hz` replaces the times of films, and `lens` is that of their camera; `speed` is how many times as fast
    the recording is played, None to search for it. `overlay` is what to draw over the film; `report` None writes no
    page. With `together` all recordings show one message; `each_at` says when each was made, empty where the files do.
    `given` are the names of options that were given and may not matter, see `unused_options`. `write_disclosed` is
    where to write the key that the public channel carries.
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
    lens: Lens | None = None
    speed: float | None = 1.0
    report: ReportRequest | None = None
    force: bool = False
    overlay: OverlayFiles = field(default_factory=OverlayFiles)
    together: bool = False
    each_at: tuple[RecordedAt, ...] = ()
    given: frozenset[str] = frozenset()
    write_disclosed: Path | None = None


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
            sources = recordings_of(options.paths) if options.together else sources_of(options.paths)
            check_pictures(options.overlay, sources)
    if options.together:
        check_together(len(sources), len(options.each_at), options.settings.onset_s, options.speed)
        with _explained(options, stages):
            text, code = _told(options, opened, stages, *_decode_together(options, opened, sources, stages))
        sys.stdout.write(text)
        return code
    if len(sources) > 1:
        report = ("--report",) if options.report else ()
        written = ("--write-disclosed",) if options.write_disclosed else ()
        single = (*(("--plot",) if options.plot else ()), *report, *written)
        return run_each(sources, single, options.as_json, lambda source: _report(options, opened, source, stages[:1]))
    text, code = _report(options, opened, sources[0], stages)
    sys.stdout.write(text)
    return code


def _check(options: DecodeOptions) -> None:
    """Refuse what would fail after the long work."""
    check_decode_values(options.settings, options.tracker, options.speed, options.frame_rate_hz)
    page = None if options.report is None else options.report.path
    check_outputs("mtm-audit decode", options.plot, page, *options.overlay.paths, force=options.force)
    if options.write_disclosed is not None:
        check_new_file(options.write_disclosed)
    if options.plot is not None:
        from mtm_audit.reporting.plot import check_plot_path

        check_plot_path(options.plot)
    if page is not None:
        from mtm_audit.reporting.report.page import check_report_path

        check_report_path(page)


@contextmanager
def _explained(options: DecodeOptions, stages: Sequence[Stage]) -> Iterator[None]:
    """Where an explanation is asked for, tell the stages that were done before the one that could not go on."""
    try:
        yield
    except StageError as error:
        if options.explain:
            sys.stderr.write(
                text_of_stages([*stages, Stage(error.stage, (str(error),), failed=True, says_what_to_do=True)])
            )
        raise


def _report(options: DecodeOptions, opened: OpenedKey, source: Source, stages: list[Stage]) -> tuple[str, int]:
    """Decode one recording: what to print of it, and its exit code."""
    with _explained(options, stages):
        recording, decoding = _decode(options, opened, source, stages)
    return _told(options, opened, stages, recording, decoding)


def _told(
    options: DecodeOptions, opened: OpenedKey, stages: list[Stage], recording: Recording, decoding: Decoding
) -> tuple[str, int]:
    explanation = ""
    if options.explain:
        explanation = text_of_stages([*stages, *stages_of_decoding(decoding)]) + "\n"
    if options.as_json:
        # Beside JSON the explanation must not get into what a program reads.
        sys.stderr.write(explanation)
        explanation = ""
    return explanation + _publish(options, opened, recording, decoding, stages), EXIT_CODES[decoding.verdict]


def _decode(
    options: DecodeOptions, opened: OpenedKey, source: Source, stages: list[Stage]
) -> tuple[Recording, Decoding]:
    """Run the chain and tell each stage that is done; a refusal names the stage that could not go on."""
    with _progress() as progress:
        recording = _recorded(options, opened, source, stages, progress)
        return decode_recording(recording, opened.key, options.settings, options.speed, _shown(progress))


def _decode_together(
    options: DecodeOptions, opened: OpenedKey, sources: Sequence[Source], stages: list[Stage]
) -> tuple[Recording, Decoding]:
    """The chain for recordings of one message; the recording is the one that shows most."""
    with _progress() as progress:
        recordings = []
        for number, source in enumerate(sources):
            timed = options
            if options.each_at:
                timed = replace(options, settings=replace(options.settings, at=options.each_at[number]))
            recordings.append((timed, _recorded(timed, opened, source, stages, progress)))
        asked = [recorded_of(recording, timed.settings, timed.speed or 1.0) for timed, recording in recordings]
        decoding, number = decode_together(asked, opened.key, _shown(progress))
    shown = recordings[number][1]
    warnings = tuple(warning for _, recording in recordings for warning in recording.warnings)
    names = tuple(source.name for source in sources)
    return replace(shown, tracks=asked[number].tracks, warnings=warnings, together=names), decoding


def _recorded(
    options: DecodeOptions, opened: OpenedKey, source: Source, stages: list[Stage], progress: Progress
) -> Recording:
    """The recording behind a source, its tracks found."""
    files, kind = source.files, source.kind
    with stage("recording"):
        frames = film_length(files) if kind == "video" else None
    if kind == "video":
        stages.append(Stage("recording", (f"video {source.name}, {frames or 'an unknown number of'} frames",)))
    task = progress.add_task(f"tracking {escape(files[0].name)}", total=frames, visible=kind == "video")
    with stage("tracks" if kind == "video" else "recording"):
        recording = read_recording(
            files,
            kind,
            options.tracker,
            lambda done: progress.update(task, completed=done),
            options=options.reading,
            frame_rate_hz=options.frame_rate_hz,
            reference=options.reference,
            lens=options.lens,
        )
        unused = unused_options(options.given, kind, opened.key.scheme.schedule)
        recording = replace(recording, warnings=(*source.warnings, *unused, *recording.warnings))
    progress.remove_task(task)
    stages[1:] = stages_of_recording(recording)
    opened.check_before_public(options.settings.at or recording.at)
    return recording


def _shown(progress: Progress) -> ReadingProgress:
    """Shows how far the reading is."""
    task = progress.add_task("reading", total=1.0)
    return lambda stage, fraction: progress.update(task, description=stage, completed=fraction)


def _publish(
    options: DecodeOptions, opened: OpenedKey, recording: Recording, decoding: Decoding, stages: Sequence[Stage]
) -> str:
    """Draw and write what is to be drawn; returns what is to be printed."""
    warnings = (*remarks(recording, decoding), *opened.warnings)
    carried = opened.carried(decoding)
    basis = opened.basis(recording, decoding, carried, stated=options.settings.at is not None)
    if options.plot is not None:
        from mtm_audit.reporting.plot import draw_plot

        draw_plot(recording, decoding, options.plot)
    if options.overlay.options:
        _draw_overlay(options, recording, decoding)
    if options.report is not None:
        from mtm_audit.reporting.report.page import write_report

        write_report(
            options.report, recording, decoding, warnings=warnings, basis=basis,
            stages=[*stages, *stages_of_decoding(decoding)], tracker=options.tracker,
        )  # fmt: skip
    if options.write_disclosed is not None and carried is not None:
        save_disclosed(carried, options.write_disclosed)
    if options.as_json:
        return json_report(recording, decoding, warnings, basis)
    console = answer_console()
    with console.capture() as captured:
        print_report(console, recording, decoding, warnings, basis)
    return captured.get()


def _draw_overlay(options: DecodeOptions, recording: Recording, decoding: Decoding) -> None:
    with _progress() as progress:
        task = progress.add_task("drawing", total=recording.frames)
        draw_overlay(
            recording, decoding, options.overlay, options.tracker, options.frame_rate_hz,
            lambda done: progress.update(task, completed=done), force=options.force,
        )  # fmt: skip


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
