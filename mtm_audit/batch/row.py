"""A row of a batch's table: what one recording says under one key, or that it says nothing."""

import csv
import io
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace

UNREADABLE = "unreadable"


@dataclass(frozen=True, kw_only=True)
class Row:
    """The columns in their order; all texts are printable and in one line. docs/batch.md says what they mean."""

    path: str
    sha256: str = ""
    verdict: str
    key: str = ""
    key_id: str = ""
    message: str = ""
    message_kind: str = ""
    authenticated: str = ""
    bits: str = ""
    chance: str = ""
    threshold: str = ""
    keys_tried: str
    duration_s: str = ""
    warnings: str = ""
    error: str = ""
    rows: str = "1"
    run: str
    seconds: str = ""


COLUMNS = tuple(column.name for column in fields(Row))


def header() -> str:
    """The table's first line, by which it is known again."""
    return ",".join(COLUMNS) + "\n"


def lines_of(rows: Sequence[Row]) -> str:
    """The rows as lines of CSV; `rows` are all of one recording, and each says how many they are."""
    written = io.StringIO()
    counted = (replace(row, rows=str(len(rows))) for row in rows)
    csv.writer(written, lineterminator="\n").writerows(map(str, astuple(row)) for row in counted)
    return written.getvalue()


def row_of(line: str) -> Row | None:
    """The row of a line; None when it is damaged."""
    try:
        (values,) = csv.reader([line], strict=True)
    except (csv.Error, ValueError):
        return None
    return Row(**dict(zip(COLUMNS, values, strict=True))) if len(values) == len(COLUMNS) else None


def printable(text: str) -> str:
    """The text in one line: what cannot be printed, such as a line's end, as an escape sequence."""
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
