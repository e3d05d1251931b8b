"""The page: everything that was found, in the words of the other reports, put into the template."""

import unicodedata
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup
from rich.table import Table
from rich.text import Text

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.advice import advice
from mtm_audit.reporting.basis import Basis
from mtm_audit.reporting.report.figures import drawings_of
from mtm_audit.reporting.report.limits import limits, shown
from mtm_audit.reporting.report.provenance import ReportRequest, provenance_of
from mtm_audit.reporting.stages import Stage
from mtm_audit.reporting.subject import files_named, now, subject_line
from mtm_audit.reporting.text import chance_sentence, facts, rests_on, table_of, verdict_sentence
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import WrongValueError
from mtm_onboard.protocol.output_file import mark_of

SUFFIXES = (".html", ".htm")
_TEMPLATE = "report.html.jinja"


def check_report_path(path: Path) -> None:
    """Raise MtmError for a name that no browser would take for a page."""
    if path.suffix.lower() not in SUFFIXES:
        raise WrongValueError(f"{path} is no name for a report, which is a page; end it in {' or '.join(SUFFIXES)}")


def write_report(
    request: ReportRequest,
    recording: Recording,
    decoding: Decoding,
    *,
    warnings: Sequence[str],
    basis: Basis,
    stages: Sequence[Stage],
    tracker: str,
) -> None:
    """Write the page whole or not at all; raises MtmError as `check_report_path` does and when an input is gone."""
    text = report_html(request, recording, decoding, warnings=warnings, basis=basis, stages=stages, tracker=tracker)
    write_page(request.path, text)


def write_page(path: Path, text: str) -> None:
    """Put the text in the place of `path`, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def report_html(
    request: ReportRequest,
    recording: Recording,
    decoding: Decoding,
    *,
    warnings: Sequence[str],
    basis: Basis,
    stages: Sequence[Stage],
    tracker: str,
) -> str:
    """The page as text; whatever a user named is escaped in it. Raises MtmError when an input cannot be hashed."""
    drawings = drawings_of(recording, decoding, tracker, subject_line(recording, decoding, now()))
    provenance = provenance_of(request, recording.paths)
    helps = advice(recording, decoding)
    page: dict[str, Any] = {
        "maker": mark_of("mtm-audit decode"),
        "verdict": decoding.verdict,
        "headline": verdict_sentence(decoding),
        "chance": chance_sentence(decoding),
        "name": files_named(recording.paths),
        "shows": shown(decoding, basis.authenticates),
        "rests": rests_on(recording, decoding, basis),
        "limits": limits(decoding),
        "advice": helps,
        "facts": facts(recording, decoding),
        "table": _plain_table(table_of(decoding)),
        "drawings": [(Markup(drawing.svg), drawing.caption) for drawing in drawings],
        "warnings": [warning for warning in (*provenance.warnings, *warnings) if warning not in helps],
        "stages": stages,
        "files": provenance.files,
        "provenance": provenance.facts,
    }
    return _template().render(page)


def _template() -> Template:
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )
    return environment.from_string(files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8"))


def _shown(value: object) -> object:
    """Text without control characters, which no page may hold; a name of a file or a track may."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return "".join("\ufffd" if unicodedata.category(letter) in ("Cc", "Cs") else letter for letter in value)


def _plain_table(table: Table) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of a table that was made for the terminal."""
    columns = [[_plain(cell) for cell in column.cells] for column in table.columns]
    return [_plain(column.header) for column in table.columns], [list(row) for row in zip(*columns, strict=True)]


def _plain(cell: object) -> str:
    return cell.plain if isinstance(cell, Text) else str(cell)
