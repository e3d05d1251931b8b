"""Result files: comments, of which the first is the command line that made them, then a table."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from mtm_onboard.protocol.atomicfile import replacing


def write_commented_csv(
    path: Path, comments: Sequence[str], columns: Sequence[str], rows: Iterable[Sequence[object]]
) -> None:
    """Write the file, whole or not at all; raises MtmError when it cannot be written."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {comment}\n" for comment in comments)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
