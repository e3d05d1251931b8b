"""Ground truth of the UTIAS MR.CLAM data set: time, x, y and orientation a line."""

from pathlib import Path

from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.columns import at_of_unix_times
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import check_rows, content_of, question_units, read_table
from mtm_audit.readers.text import read_lines

COLUMNS = 4


def recognises_mrclam(opening: Opening) -> bool:
    """Whether a comment speaks of an orientation, or the name ends in .dat, and lines have four cells."""
    said = any("orientation" in line.lower() for line in opening.lines if line.lstrip().startswith("#"))
    return (said or opening.suffix == ".dat") and bool(opening.content) and len(opening.content[0].split()) == COLUMNS


def read_mrclam(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file, in seconds since the Unix epoch, metres and radians."""
    table = read_table(path, content_of(read_lines(path)), None, COLUMNS, "'time x y orientation'")
    times_s = table.values[:, 0] * options.seconds()
    positions_m = table.values[:, [1, 2, 2]] * options.metres()
    positions_m[:, 2] = 0.0
    check_rows(path, table.lines, times_s, positions_m)
    question_units(path, times_s, positions_m, warn)
    return Log((Body(path.stem, times_s, positions_m, headings_rad=table.values[:, 3]),), at=at_of_unix_times(times_s))
