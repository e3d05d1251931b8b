"""Poses of one body as a file has them, and the track that they make."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import FARTHEST, Floats, Track
from mtm_audit.readers.logs.orientation import headings_of_quaternions, horizontal
from mtm_onboard.protocol.errors import MtmError

Warn = Callable[[str], None]

# Of the times that come out of order: messages overtake each other now and then, mixed recordings all the time.
_MOST_OVERTAKEN = 0.05


@dataclass(frozen=True)
class Body:
    """Where one body was and how it was turned.

    `times_s` (n,) the recording's own clock; `positions_m` (n, 3), NaN where not observed; `quaternions_xyzw` (n, 4)
    from the body to the frame of the positions, or `headings_rad` (n,) counter-clockwise from the first horizontal
    axis, when the file has either; `up` the axis of that frame that points away from the floor.
    """

    name: str
    times_s: Floats
    positions_m: Floats
    quaternions_xyzw: Floats | None = None
    headings_rad: Floats | None = None
    up: str = "z"


@dataclass(frozen=True)
class Log:
    """What a reader found: `bodies`, ready `tracks` of what is no body in a room, and when the clock stood at zero."""

    bodies: tuple[Body, ...] = ()
    tracks: tuple[Track, ...] = ()
    at: RecordedAt | None = None


def track_of(body: Body, where: str, warn: Warn) -> Track:
    """The track of a body on the floor: axes x and y in metres.

    Of rows with the same time the first is kept; `warn` is told, and when times come out of order now and then.
    `where` names the file. Raises MtmError when times run backwards throughout or nothing was observed.
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
    headings = body.headings_rad if body.headings_rad is None else body.headings_rad[rows]
    if body.quaternions_xyzw is not None:
        headings = headings_of_quaternions(body.quaternions_xyzw[rows], body.up)
    if headings is not None:
        headings = np.where(np.isfinite(headings), headings, np.nan)
        headings = headings if np.isfinite(headings).any() else None
    positions = np.where(valid[:, None], positions, np.nan)
    return Track(body.name, times_s, positions, np.asarray(valid, dtype=np.bool_), headings_rad=headings)


def _rows_in_order(body: Body, where: str, warn: Warn) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
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
