"""Result files: a table under comments that say which command line and which code made it."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from hil.experiments.runs.fingerprint import code_fingerprint
from mtm_onboard.protocol.atomicfile import replacing


def provenance(command: str, notes: Sequence[str] = ()) -> tuple[str, ...]:
    """The comments of a results file, a line each: the command line, the code's fingerprint, then `notes`."""
    return command, f"code {code_fingerprint()}", *notes


def write_result_csv(
    path: Path, command: str, columns: Sequence[str], rows: Iterable[Sequence[object]], notes: Sequence[str] = ()
) -> None:
    """Write a table under its `provenance`, whole or not at all; raises MtmError when it cannot be written."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {comment}\n" for comment in provenance(command, notes))
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
