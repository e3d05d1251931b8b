"""Logs of a Crazyflie as its client writes them: CSV with a time in milliseconds and the names of log variables."""

from pathlib import Path

from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.columns import Column, Columns, header_columns, read_columns
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import content_of
from mtm_audit.readers.text import read_lines
from mtm_onboard.protocol.errors import MtmError

# Estimates before measurements; of each the form of its names and the unit of its positions.
_POSES = (
    ("stateestimate_{}", "m"), ("kalman_state{}", "m"), ("stateestimatez_{}", "mm"), ("locsrv_{}", "m"),
    ("lighthouse_{}", "m"),
)  # fmt: skip
_TIMES = ("timestamp", "time", "tick", "t")
_GROUPS = ("stateestimate", "stateestimatez", "stabilizer", "kalman", "locsrv", "lighthouse")


def recognises_crazyflie(opening: Opening) -> bool:
    """Whether the header has a log variable of the Crazyflie, such as stateEstimate.x."""
    line = opening.content[0].lower() if opening.content else ""
    return any(f"{group}." in line for group in _GROUPS)


def read_crazyflie(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file; the yaw of stateEstimate and stabilizer is in degrees."""
    content = content_of(read_lines(path))
    header, rows = content[0], content[1:]
    by_name = {column.name: column for column in header_columns(header[1])}
    time = next((by_name[name] for name in _TIMES if name in by_name), None)
    for form, unit in _POSES:
        x, y, z = (by_name.get(form.format(axis)) for axis in "xyz")
        if time is not None and x is not None and y is not None:
            stamp = Column(time.index, time.name, time.unit or "ms")
            place = (Column(x.index, x.name, unit), Column(y.index, y.name, unit))
            return read_columns(path, header, rows, Columns(stamp, place, z, _turn(by_name)), options, warn)
    raise MtmError(
        f"{path} is a log of a Crazyflie without a time or a position; log stateEstimate.x, stateEstimate.y and "
        "stateEstimate.yaw"
    )


def _turn(by_name: dict[str, Column]) -> tuple[Column, ...]:
    quaternion = tuple(by_name[name] for name in (f"stateestimate_q{a}" for a in "xyzw") if name in by_name)
    yaw = by_name.get("stateestimate_yaw") or by_name.get("stabilizer_yaw")
    if len(quaternion) == 4:
        return quaternion
    return () if yaw is None else (Column(yaw.index, yaw.name, "deg"),)
