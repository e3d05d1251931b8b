"""Poses of one body as a file has them, and the track that they make."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import FARTHEST, Floats, Track
from mtm_audit.readers.logs.orientation import (
    heading_axis_of,
    headings_of_quaternions,
    horizontal,
    stands_upright,
)
from mtm_onboard.protocol.errors import MtmError

Warn = Callable[[str], None]
Rows = np.ndarray[tuple[int], np.dtype[np.intp]]

# Of the times that come out of order: messages overtake each other now and then, mixed recordings all the time.
_MOST_OVERTAKEN = 0.05


@dataclass(frozen=True)
class Body:
    """Where one body was and how it was turned.

    `times_s` (n,) the recording's own clock; `positions_m` (n, 3), NaN where not observed; `quaternions_xyzw` (n, 4)
    from the body to the frame of the positions, or `headings_rad` (n,) counter-clockwise from the first horizontal
    axis, when the file has either; `up` the axis of that frame that points away from the floor. `heading_axis` is the
    axis of the body that `headings_rad` are of, where the reader chose it.
    """

    name: str
    times_s: Floats
    positions_m: Floats
    quaternions_xyzw: Floats | None = None
    headings_rad: Floats | None = None
    up: str = "z"
    heading_axis: str | None = None


@dataclass(frozen=True)
class Log:
    """What a reader found: `bodies`, ready `tracks` of what is no body in a room, and when the clock stood at zero."""

    bodies: tuple[Body, ...] = ()
    tracks: tuple[Track, ...] = ()
    at: RecordedAt | None = None


def track_of(body: Body, where: str, warn: Warn, heading_axis: str | None = None) -> Track:
    """The track of a body on the floor: axes x and y in metres.

    `heading_axis` is the axis of the body whose direction is its heading, None for one that lies level. Of rows with
    the same time the first is kept; `warn` is told, and when times come out of order now and then, and when that axis
    shows no heading. `where` names the file. Raises MtmError when times run backwards throughout or nothing was
    observed.
    """
    rows = _rows_in_order(body, where, warn)
    times_s = body.times_s[rows]
    if not len(times_s):
        raise MtmError(f"{where} holds no poses of {body.name}; record it again")
    positions = horizontal(body.positions_m[rows], body.up)
    with np.errstate(invalid="ignore"):
        valid = np.all(np.isfinite(positions) & (np.abs(positions) <= FARTHEST), axis=1)
    if not valid.any():
        raise MtmError(f"{where} holds no position of {body.name} that was observed; record it in sight")
    headings, axis = _headings(body, rows, where, warn, heading_axis)
    positions = np.where(valid[:, None], positions, np.nan)
    seen = np.asarray(valid, dtype=np.bool_)
    return Track(body.name, times_s, positions, seen, headings_rad=headings, heading_axis=axis)


def _headings(body: Body, rows: Rows, where: str, warn: Warn, asked: str | None) -> tuple[Floats | None, str | None]:
    """Headings of the rows, None when there are none, and the axis of the body that they are of, None when unknown."""
    quaternions = None if body.quaternions_xyzw is None else body.quaternions_xyzw[rows]
    if quaternions is None or not np.isfinite(quaternions).all(axis=1).any():
        headings, axis = None if body.headings_rad is None else body.headings_rad[rows], body.heading_axis
        if asked is not None and axis is None:
            warn(f"{where}: how {body.name} is turned in three dimensions is not there, so --heading-axis is not used")
    else:
        axis = chosen_axis(quaternions, body.up, asked, f"{where}: the {asked} axis of {body.name}", warn)
        headings = headings_of_quaternions(quaternions, body.up, axis)
    if headings is None or not np.isfinite(headings).any():
        return None, None
    return np.where(np.isfinite(headings), headings, np.nan), axis


def chosen_axis(quaternions_xyzw: Floats, up: str, asked: str | None, which: str, warn: Warn) -> str:
    """The axis of a body whose direction is its heading: the one that was asked for, else one that lies level.

    Where the one that was asked for, which `which` names, stands upright, `warn` is told, and another is taken.
    """
    if asked is not None and not stands_upright(quaternions_xyzw, up, asked):
        return asked
    axis = heading_axis_of(quaternions_xyzw, up)
    if asked is not None:
        warn(
            f"{which} stands upright and shows no heading, so its {axis} axis is taken; give another --heading-axis, "
            "or check --up"
        )
    return axis


def _rows_in_order(body: Body, where: str, warn: Warn) -> Rows:
    """Numbers of the rows to keep, by time."""
    rows = np.flatnonzero(np.isfinite(body.times_s))
    steps_s = np.diff(body.times_s[rows])
    backwards = int(np.sum(steps_s < 0))
    if backwards > max(1.0, _MOST_OVERTAKEN * len(steps_s)):
        raise MtmError(
            f"{where}: times of {body.name} run backwards {backwards} times; split it where a clock was set or a "
            "recording began anew"
        )
    if backwards:
        warn(f"{where}: {backwards} of the times of {body.name} came out of order and were sorted")
    rows = rows[np.argsort(body.times_s[rows], kind="stable")]
    repeated = np.flatnonzero(np.diff(body.times_s[rows]) == 0) + 1
    if len(repeated):
        many = "1 row repeats" if len(repeated) == 1 else f"{len(repeated)} rows repeat"
        warn(f"{where}: {many} the time of the row before and {'was' if len(repeated) == 1 else 'were'} left out")
    return np.delete(rows, repeated)
