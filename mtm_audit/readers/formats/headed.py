"""Tables with a header that names time, x and y, optionally z and yaw or a quaternion; EuRoC's among them."""

from dataclasses import replace
from pathlib import Path

from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.columns import header_columns, lacking, pose_columns, read_columns
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import Line, content_of, separator_of
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

# The position in the names of EuRoC's data set, whose times are nanoseconds with and without the word.
_OF_EUROC = "p_rs_r"


def recognises_headed(opening: Opening) -> bool:
    """Whether the last comment before the numbers, or the first line that is none, names a time, an x and a y."""
    return _header(opening.lines) is not None


def read_headed(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file; empty cells and NaN are samples that were not observed."""
    lines = read_lines(path)
    header = _header(lines)
    content = content_of(lines)
    if header is None:
        if not content:
            raise MtmError(f"{path} holds no samples; export the recording again")
        raise lacking(path, header_columns(content[0][1]))
    columns = pose_columns(header_columns(header[1]))
    assert columns is not None
    if columns.time.unit is None and columns.position[0].name.startswith(_OF_EUROC):
        columns = replace(columns, time=replace(columns.time, unit="ns"))
    return read_columns(path, header, [line for line in content if line[0] > header[0]], columns, options, warn)


def _header(lines: list[str] | tuple[str, ...]) -> Line | None:
    """The header's line number and text; None when there is none with a pose."""
    last = None
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        comment = line.lstrip().startswith("#")
        if separator_of(line.lstrip("# ")) is not None or not comment:
            try:
                posed = pose_columns(header_columns(line)) is not None
            except ValueError:
                posed = False
            last = (number, line) if posed else last
        if not comment:
            return last
    return last
