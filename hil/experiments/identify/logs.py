"""Commands and true motion of one robot from files.

Commands: an odometry file of the MR.CLAM data sets (`time forward-speed turn-rate` a line), a journal of ours, or a CSV
table whose header names `time` and some of `vx`, `vy`, `wz`. Motion: MR.CLAM's ground truth (`time x y heading` a
line), or any file of motion capture that `mtm-audit decode` reads and that has headings. Times in s, speeds in m/s and
rad/s.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.experiments.detectors.body_frame import in_body_frame
from mtm_audit.ingest.load import is_video, load_tracks
from mtm_audit.model.track import Floats, Track
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.readers.text import read_lines
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import COLUMNS, read_journal

_ODOMETRY, _TRUTH = 3, 4
_SHORTEST_GAP_S = 0.15


@dataclass(frozen=True)
class CommandLog:
    """What was commanded: `velocities` (n, 3) of vx, vy, wz, each from its time of `times_s` (n,) on until the next."""

    times_s: Floats
    velocities: Floats


@dataclass(frozen=True)
class LoggedRun:
    """Commands and motion as means over equal time bins: `commanded` and `moved` (n, 3) along vx, vy and wz.

    `seen` (n,) is False where the motion was not observed.
    """

    step_s: float
    commanded: Floats
    moved: Floats
    seen: Floats


def read_commands(path: Path, later_s: float = 0.0) -> CommandLog:
    """Read a file of commands, whose times are moved by `later_s`; those of a journal count from its first tick.

    Of commands of one instant the last counts. Raises MtmError when the file is no such file.
    """
    lines = read_lines(path)
    if any(line.startswith(",".join(COLUMNS)) for line in lines[:60]):
        record = read_journal(path)
        times_s: Floats = record.ticks / record.header.rate_hz
        velocities: Floats = record.sent
    elif "," in next((line for line in lines if line.strip() and not line.startswith("#")), ""):
        times_s, velocities = _command_table(path, lines)
    else:
        rows = _numbers(path, lines, _ODOMETRY, "'time forward-speed turn-rate'")
        times_s, velocities = rows[:, 0], np.column_stack([rows[:, 1], np.zeros(len(rows)), rows[:, 2]])
    order = np.argsort(times_s, kind="stable")
    last = np.append(np.diff(times_s[order]) > 0.0, True)
    return CommandLog(np.asarray(times_s[order][last] + later_s), np.asarray(velocities[order][last]))


def read_truth(path: Path, heading_axis: str | None = None) -> Track:
    """Read a file of the robot's motion with headings; raises MtmError when it is no such file or has no headings.

    `heading_axis` is the axis of the tracked body that points ahead, such as `x` or `-z`; without it the one that lies
    level.
    """
    if heading_axis is not None and (path.suffix.lower() == ".dat" or is_video(path)):
        raise MtmError(f"{path} states the heading itself; leave --heading-axis out")
    if path.suffix.lower() == ".dat":
        rows = _numbers(path, read_lines(path), _TRUTH, "'time x y heading'")
        kept = np.concatenate([[True], np.diff(np.maximum.accumulate(rows[:, 0])) > 0.0])
        rows = rows[kept]
        return Track(path.stem, rows[:, 0], rows[:, 1:3], np.ones(len(rows), bool), headings_rad=rows[:, 3])
    tracks = load_tracks(path) if is_video(path) else read_log(path, ReadOptions(heading_axis=heading_axis)).tracks
    if len(tracks) != 1:
        raise MtmError(f"{path} shows {len(tracks)} bodies; name a recording of one robot")
    if tracks[0].headings_rad is None:
        raise MtmError(f"{path} has no headings, which tell ahead from sideways; name a file that has them")
    return tracks[0]


def logged_run(commands: CommandLog, truth: Track, rate_hz: float) -> LoggedRun:
    """Both logs on common time bins; raises MtmError where they do not overlap."""
    body = in_body_frame(truth)
    start_s = max(commands.times_s[0], body.times_s[0])
    count = int((min(commands.times_s[-1], body.times_s[-1]) - start_s) * rate_hz)
    if count < 1:
        raise MtmError(
            f"the commands run from {commands.times_s[0]:.1f} to {commands.times_s[-1]:.1f} s and the motion from "
            f"{body.times_s[0]:.1f} to {body.times_s[-1]:.1f} s, at no time together; give --offset"
        )
    edges_s = start_s + np.arange(count + 1) / rate_hz
    moved = np.stack([np.interp(edges_s, body.times_s, own) for own in body.positions.T], axis=1)
    gaps = np.diff(body.times_s) > max(_SHORTEST_GAP_S, 2.5 * float(np.median(np.diff(body.times_s))))
    hidden = np.zeros(count, dtype=bool)
    for begin_s, end_s in zip(body.times_s[:-1][gaps], body.times_s[1:][gaps], strict=True):
        hidden |= (edges_s[1:] > begin_s) & (edges_s[:-1] < end_s)
    return LoggedRun(
        1.0 / rate_hz, np.diff(_integrated(commands, edges_s), axis=0) * rate_hz, np.diff(moved, axis=0) * rate_hz,
        ~hidden,
    )  # fmt: skip


def _integrated(commands: CommandLog, instants_s: Floats) -> Floats:
    """What the commands, each held until the next, add up to at those instants, (n, 3)."""
    times_s, velocities = commands.times_s, commands.velocities
    steps = np.diff(times_s)[:, None] * velocities[:-1]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return np.stack([np.interp(instants_s, times_s, own) for own in sums.T], axis=1)


def _command_table(path: Path, lines: list[str]) -> tuple[Floats, Floats]:
    rows = list(csv.reader(line for line in lines if line.strip() and not line.lstrip().startswith("#")))
    header = [name.strip().lower() for name in rows[0]]
    named = [axis for axis in AXES if axis in header]
    if "time" not in header or not named:
        raise MtmError(f"{path}: the header must name 'time' and some of 'vx', 'vy' and 'wz'; mend the table")
    body = _numbers(path, [",".join(row) for row in rows[1:]], len(header), f"'{','.join(header)}'", ",")
    columns = [body[:, header.index(axis)] if axis in named else np.zeros(len(body)) for axis in AXES]
    return body[:, header.index("time")], np.stack(columns, axis=1)


def _numbers(path: Path, lines: list[str], columns: int, form: str, parted: str | None = None) -> Floats:
    """The lines' numbers (n, columns), without comments; raises MtmError when one has others, or there are too few."""
    rows = []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(cell) for cell in line.split(parted)]
        except ValueError:
            row = []
        if len(row) != columns or not np.all(np.isfinite(row)):
            raise MtmError(f"{path}, line {number}: expected {columns} numbers, {form}; mend or remove the line")
        rows.append(row)
    if len(rows) < 2:
        raise MtmError(f"{path} holds {len(rows)} lines of numbers; record more")
    return np.array(rows)
