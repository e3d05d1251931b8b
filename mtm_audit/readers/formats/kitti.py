"""KITTI odometry: twelve numbers of a 3 x 4 matrix a line, and a file of times beside it."""

from pathlib import Path

import numpy as np

from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.columns import at_of_unix_times
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import quaternions_of_matrices
from mtm_audit.readers.logs.table import check_rows, content_of, read_table, unit_of_times
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

COLUMNS = 12


def recognises_kitti(opening: Opening) -> bool:
    """Whether the first line that is no comment has twelve numbers."""
    cells = opening.content[0].split() if opening.content else []
    try:
        return len(cells) == COLUMNS and all(np.isfinite(float(cell)) for cell in cells)
    except ValueError:
        return False


def read_kitti(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body in the frame of a camera, whose y axis points down; times in seconds from `times.txt`.

    Raises MtmError when there are no times: poses without them tell nothing of motion.
    """
    table = read_table(path, content_of(read_lines(path)), None, COLUMNS, "the rows of a 3 x 4 matrix")
    times_path = _times_path(path)
    times = read_table(times_path, content_of(read_lines(times_path)), None, 1, "'time'").values[:, 0]
    if len(times) != len(table.values):
        raise MtmError(
            f"{times_path} has {len(times)} times and {path} {len(table.values)} poses; find the times of these"
        )
    times_s = times * options.seconds(None if options.time_unit else unit_of_times(times_path, times, warn))
    matrices = table.values.reshape(-1, 3, 4)
    positions_m = matrices[:, :, 3] * options.metres()
    check_rows(path, table.lines, times_s, positions_m)
    turns = quaternions_of_matrices(matrices[:, :, :3])
    body = Body(path.stem, times_s, positions_m, quaternions_xyzw=turns, up=options.up or "-y")
    return Log((body,), at=at_of_unix_times(times_s))


def _times_path(path: Path) -> Path:
    """The file of times of a file of poses, where the benchmark or its users put it."""
    beside = [path.with_name(f"{path.stem}_times.txt"), path.with_name("times.txt")]
    around = [path.parent.parent / "sequences" / path.stem / "times.txt"]
    for candidate in (*beside, *around):
        if candidate.is_file() and candidate != path:
            return candidate
    raise MtmError(f"{path} holds poses of KITTI's form, which have no times; put them beside it in a file times.txt")
