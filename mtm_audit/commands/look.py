"""`mtm-audit look`: what is in recordings, without a key."""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from mtm_audit.drawing.film import write_picture
from mtm_audit.drawing.output import check_output_path
from mtm_audit.ingest.films import film_length
from mtm_audit.ingest.source import Source, sources_of
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.video.clock import EvenClock
from mtm_audit.reporting.look.commands import film_commands, log_commands
from mtm_audit.reporting.look.json_text import film_entry, log_entry, look_report
from mtm_audit.reporting.look.picture import survey_picture
from mtm_audit.reporting.look.sentences import Line, film_lines, log_lines
from mtm_audit.survey.film import survey_film
from mtm_audit.survey.log import survey_log
from mtm_onboard.protocol.errors import MtmError, command_line_values
from mtm_onboard.protocol.output_file import check_outputs

_COMMAND = "mtm-audit look"
_HEAD = 11


@dataclass(frozen=True, kw_only=True)
class LookOptions:
    """What the command line asked for; `picture` None draws none, `frame_rate_hz` replaces the times of films."""

    paths: tuple[Path, ...]
    picture: Path | None
    as_json: bool
    frame_rate_hz: float | None
    force: bool = False
    reading: ReadOptions = field(default_factory=ReadOptions)


def run_look(options: LookOptions) -> int:
    """Look at each recording and say what is in it; returns the exit code, 1 when one of several cannot be read.

    Raises MtmError when there is one and it cannot be read, when there is no picture to draw, or several.
    """
    if options.picture is not None:
        check_output_path(options.picture, (".png",))
    check_outputs(_COMMAND, options.picture, force=options.force)
    if options.frame_rate_hz is not None:
        with command_line_values():
            EvenClock(options.frame_rate_hz)
    sources = sources_of(options.paths)
    if options.picture is not None:
        _check_picture(options.picture, sources)
    if len(sources) == 1:
        text, entries = _looked(options, sources[0], options.paths)
        sys.stdout.write(look_report(entries) if options.as_json else text)
        return 0
    found: list[dict[str, Any]] = []
    code = 0
    for source in sources:
        try:
            text, entries = _looked(options, source, source.files)
        except MtmError as error:
            sys.stderr.write(f"mtm-audit: {source.name}: {error}\n")
            code = 1
            continue
        found += entries
        if not options.as_json:
            sys.stdout.write(f"== {source.name}\n{text}\n")
            sys.stdout.flush()
    if options.as_json:
        sys.stdout.write(look_report(found))
    return code


def _check_picture(picture: Path, sources: tuple[Source, ...]) -> None:
    if len(sources) > 1:
        raise MtmError(f"--picture draws one recording, and {len(sources)} are named; name one")
    if sources[0].kind != "video":
        raise MtmError(f"{sources[0].name} has no pictures to draw on; leave --picture out")
    if any(picture.exists() and picture.samefile(file) for file in sources[0].files):
        raise MtmError(f"{picture} is the recording itself; name another file to draw into")


def _looked(options: LookOptions, source: Source, paths: tuple[Path, ...]) -> tuple[str, list[dict[str, Any]]]:
    """What to print of one recording, and its entries as JSON has them."""
    return _film(options, source, paths) if source.kind == "video" else _logs(options, source, paths)


def _film(options: LookOptions, source: Source, paths: tuple[Path, ...]) -> tuple[str, list[dict[str, Any]]]:
    with _progress() as progress:
        task = progress.add_task("looking", total=film_length(source.files))
        survey = survey_film(
            source,
            options.frame_rate_hz,
            lambda what, count: progress.update(task, description=what, completed=count),
        )
    commands = film_commands(survey, paths, options.frame_rate_hz)
    if options.picture is not None:
        write_picture(survey_picture(survey), options.picture, _COMMAND, force=options.force)
    lines = film_lines(survey, options.frame_rate_hz)
    return _text(lines, commands, survey.warnings), [film_entry(survey, commands)]


def _logs(options: LookOptions, source: Source, paths: tuple[Path, ...]) -> tuple[str, list[dict[str, Any]]]:
    with _progress() as progress:
        task = progress.add_task("looking", total=None)
        surveys = [
            survey_log(file, options.reading, lambda name: progress.update(task, description=name))
            for file in source.files
        ]
    commands = log_commands(surveys, paths)
    lines = [line for survey in surveys for line in log_lines(survey)]
    warnings = (*source.warnings, *(warning for survey in surveys for warning in survey.warnings))
    return _text(lines, commands, warnings), [log_entry(survey, commands) for survey in surveys]


def _text(lines: list[Line], commands: tuple[str, ...], warnings: tuple[str, ...]) -> str:
    said = [f"{head:<{_HEAD}}{line}" for head, line in lines]
    said += [f"{'try' if number == 0 else '':<{_HEAD}}{command}" for number, command in enumerate(commands)]
    said += [f"warning: {warning}" for warning in warnings]
    # Names come from outside, and must not command a terminal.
    return "\n".join("".join(letter if letter.isprintable() else "?" for letter in line) for line in said) + "\n"


def _progress() -> Progress:
    """A bar on standard error, gone when the work is done, and only where a person watches."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)
