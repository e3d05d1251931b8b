"""TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, as the RGB-D benchmark and evo have them."""

from pathlib import Path

from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.columns import at_of_unix_times
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import check_rows, content_of, question_units, read_table, unit_of_times
from mtm_audit.readers.text import read_lines

COLUMNS = 8


def recognises_tum(opening: Opening) -> bool:
    """Whether the first line that is no comment has eight numbers."""
    return bool(opening.content) and len(opening.content[0].split()) == COLUMNS and _starts_with_number(opening)


def read_tum(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file; a line with a NaN is a sample that was not observed."""
    table = read_table(path, content_of(read_lines(path)), None, COLUMNS, "'timestamp tx ty tz qx qy qz qw'")
    times = table.values[:, 0]
    times_s = times * options.seconds(None if options.time_unit else unit_of_times(path, times, warn))
    positions_m = table.values[:, 1:4] * options.metres()
    check_rows(path, table.lines, times_s, positions_m)
    question_units(path, times_s, positions_m, warn)
    body = Body(path.stem, times_s, positions_m, quaternions_xyzw=table.values[:, 4:], up=options.up or "z")
    return Log((body,), at=at_of_unix_times(times_s))


def _starts_with_number(opening: Opening) -> bool:
    try:
        float(opening.content[0].split()[0].replace(",", "."))
    except ValueError:
        return False
    return True
