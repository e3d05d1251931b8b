"""`mtm-audit decode`: from files to a verdict, and everything that a person or a program sees of it."""

import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors import make_detector
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.stage import StageError, stage
from mtm_audit.readers.video import inspect_video
from mtm_audit.reporting.basis import Basis, Disclosure, basis_of
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.stages import Stage, stages_of_decoding, stages_of_recording, text_of_stages
from mtm_audit.reporting.text import print_report
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.disclosure import load_anchor, load_disclosed
from mtm_onboard.protocol.key import Key, load_key

_PIPE_COLUMNS = 140
EXIT_CODES = {"decoded": 0, "absent": 3, "inconclusive": 4}


@dataclass(frozen=True)
class KeySource:
    """A key file, or else a public anchor and a disclosed day's key."""

    key: Path | None
    anchor: Path | None = None
    disclosed: Path | None = None


@dataclass(frozen=True)
class _Opened:
    """A key, and since when it may be public where it was disclosed."""

    key: Key
    public_from: datetime | None


@dataclass(frozen=True)
class DecodeOptions:
    """What the command line asked for; `plot` None draws nothing."""

    paths: tuple[Path, ...]
    source: KeySource
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
        opened, recording, decoding = _decode(options, stages)
    except StageError as error:
        if options.explain:
            sys.stderr.write(text_of_stages([*stages, Stage(error.stage, (str(error),), failed=True)]))
        raise
    if options.explain:
        # Beside JSON the explanation must not get into what a program reads.
        stream = sys.stderr if options.as_json else sys.stdout
        stream.write(text_of_stages([*stages, *stages_of_decoding(decoding)]) + "\n")
    _publish(options, opened, recording, decoding)
    return EXIT_CODES[decoding.verdict]


def _check(options: DecodeOptions) -> None:
    """Refuse what would fail after the long work."""
    make_detector(options.settings.detector, options.settings.profile)
    tracker(options.tracker)
    if options.plot is not None:
        from mtm_audit.reporting.plot import check_plot_path

        check_plot_path(options.plot)


def _decode(options: DecodeOptions, stages: list[Stage]) -> tuple[_Opened, Recording, Decoding]:
    """Run the chain and tell each stage that is done; a refusal names the stage that could not go on."""
    with stage("key"):
        opened = _opened(options)
    key = opened.key
    stages.append(Stage("key", (f"{key.id}, scheme {key.scheme.name} (fingerprint {key.scheme.fingerprint})",)))
    with _progress() as progress:
        with stage("recording"):
            files, kind = recording_files(options.paths)
            frames = inspect_video(files[0]).frame_count if kind == "video" else None
        if kind == "video":
            stages.append(Stage("recording", (f"video {files[0]}, {frames or 'an unknown number of'} frames",)))
        task = progress.add_task(f"tracking {files[0].name}", total=frames, visible=kind == "video")
        with stage("tracks" if kind == "video" else "recording"):
            recording = read_recording(files, kind, options.tracker, lambda done: progress.update(task, completed=done))
        progress.remove_task(task)
        stages[1:] = stages_of_recording(recording)
        _check_before_public(opened, options.settings.at or recording.at)
        return opened, recording, _read(recording, key, options.settings, progress)


def _check_before_public(opened: _Opened, at: RecordedAt | None) -> None:
    public_from = opened.public_from
    if public_from is not None and at is not None and at.unix_s >= public_from.timestamp():
        with stage("verdict"):
            raise MtmError(
                f"the film is from after {public_from:%Y-%m-%d %H:%M} UTC, when the disclosed key was public: by then "
                "everybody could make such a motion, so it proves nothing; verify films of the disclosed day"
            )


def _opened(options: DecodeOptions) -> _Opened:
    """The key; raises MtmError when it may not be used, or is not that of its day in the anchor's chain."""
    source = options.source
    if source.key is not None:
        key = load_key(source.key)
        options.settings.revoked.check(key)
        if (grant := key.holding.grant) is not None:
            grant.check_unexpired(datetime.now(UTC).timestamp())
        return _Opened(key, None)
    assert source.anchor is not None
    assert source.disclosed is not None
    anchor = load_anchor(source.anchor)
    key = load_disclosed(source.disclosed, anchor)
    grant = key.holding.grant
    assert grant is not None
    return _Opened(key, anchor.disclosed_from(grant.first_day))


def _read(recording: Recording, key: Key, settings: DecodeSettings, progress: Progress) -> Decoding:
    task = progress.add_task("reading", total=1.0)

    def show(stage: str, fraction: float) -> None:
        progress.update(task, description=stage, completed=fraction)

    # What a person says of the recording's time comes before what the file says.
    timed = settings if settings.at is not None else replace(settings, at=recording.at)
    return decode_tracks(recording.tracks, key, timed, show)


def _basis(options: DecodeOptions, opened: _Opened, recording: Recording, decoding: Decoding) -> Basis:
    disclosure = None
    if opened.public_from is not None:
        written = datetime.fromtimestamp(max(path.stat().st_mtime for path in recording.paths), UTC)
        disclosure = Disclosure(opened.public_from, options.settings.at is not None, written)
    return basis_of(decoding, opened.key.holding.grant, disclosure)


def _publish(options: DecodeOptions, opened: _Opened, recording: Recording, decoding: Decoding) -> None:
    key_warning = () if opened.key.warning is None else (opened.key.warning,)
    warnings = (*remarks(recording, decoding), *key_warning)
    basis = _basis(options, opened, recording, decoding)
    if options.plot is not None:
        from mtm_audit.reporting.plot import draw_plot

        draw_plot(recording, decoding, options.plot)
    if options.as_json:
        sys.stdout.write(json_report(recording, decoding, warnings, basis))
    else:
        # In a pipe nobody sees where a line ends, and a cut table cannot be read.
        print_report(
            Console(width=None if sys.stdout.isatty() else _PIPE_COLUMNS), recording, decoding, warnings, basis
        )


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
