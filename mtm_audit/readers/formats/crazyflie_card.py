"""Logs that a Crazyflie writes to its memory card: events with a time and variables of fixed types."""

import struct
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.text import read_bytes
from mtm_onboard.protocol.errors import MtmError

WHAT = "a log from a Crazyflie's memory card"
_MAGIC, _VERSIONS, _HEAD = 0xBC, (1, 2), struct.Struct("<BHH")
# Time stamps of version 1 are milliseconds in 32 bits, those of version 2 microseconds in 64.
_STAMPS = {1: (struct.Struct("<HI"), "ms"), 2: (struct.Struct("<HQ"), "us")}
_TYPES = "bBhHiIqQefd?"
_LONGEST_NAME, _MOST_EVENTS, _MOST_VARIABLES = 200, 100, 500
# Estimates before measurements, and metres in each unit.
_POSITIONS = (("stateEstimate.", 1.0), ("kalman.state", 1.0), ("stateEstimateZ.", 0.001), ("locSrv.", 1.0))

Values = dict[str, list[float]]


@dataclass(frozen=True)
class _Event:
    row: struct.Struct
    variables: tuple[str, ...]


def recognises_crazyflie_card(opening: Opening) -> bool:
    """Whether it begins with the format's mark, a known version and the name of an event."""
    start = opening.start
    if len(start) < 16 or start[0] != _MAGIC:
        return False
    _, version, events = _HEAD.unpack_from(start)
    return version in _VERSIONS and 0 < events <= _MOST_EVENTS and start[7:8].isalpha()


def read_crazyflie_card(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """One body, named after the file, in the time since the Crazyflie started; yaw is in degrees.

    A log that was cut or damaged is read as far as it goes, and `warn` is told. Raises MtmError when it names no
    position.
    """
    data = read_bytes(path)
    if len(data) < 4 or crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
        warn(f"{path} is {WHAT} that was cut or damaged; what comes before is read")
    try:
        version, events, begin = _described(data)
    except (struct.error, IndexError, ValueError) as error:
        raise MtmError(f"{path} is {WHAT} whose header is damaged; copy it again") from error
    unit = _STAMPS[version][1]
    logged = _logged(data, version, events, begin)
    for values in logged.values():
        for prefix, scale in _POSITIONS:
            names = [f"{prefix}{axis}" for axis in ("XYZ" if prefix.startswith("kalman") else "xyz")]
            if names[0] in values and names[1] in values:
                times_s = np.array(values["time"]) * options.seconds(unit)
                return Log((_body(path, times_s, values, names, scale, options),))
    if not any(values["time"] for values in logged.values()):
        raise MtmError(f"{path} is {WHAT} in which nothing was logged; record it again")
    named = sorted({name for event in events.values() for name in event.variables})
    raise MtmError(f"{path} is {WHAT} without a position but with {', '.join(named)[:200]}; log stateEstimate.x and y")


def _body(path: Path, times_s: Floats, values: Values, names: list[str], scale: float, options: ReadOptions) -> Body:
    # The height comes last and may be missing.
    places = [np.array(values.get(name, np.zeros(len(times_s))), dtype=float) for name in names]
    positions_m = np.stack(places, axis=1) * scale * options.metres()
    quaternion = [values[f"stateEstimate.q{axis}"] for axis in "xyzw" if f"stateEstimate.q{axis}" in values]
    if len(quaternion) == 4:
        return Body(path.stem, times_s, positions_m, np.array(quaternion, dtype=float).T, up=options.up or "z")
    yaw = values.get("stateEstimate.yaw", values.get("stabilizer.yaw"))
    headings = None if yaw is None else np.deg2rad(np.array(yaw, dtype=float))
    return Body(path.stem, times_s, positions_m, headings_rad=headings, up=options.up or "z")


def _described(data: bytes) -> tuple[int, dict[int, _Event], int]:
    """The version, the events by number, and where the first logged one begins."""
    _, version, count = _HEAD.unpack_from(data)
    at, events = _HEAD.size, {}
    for _ in range(min(count, _MOST_EVENTS)):
        (number,) = struct.unpack_from("<H", data, at)
        _, at = _name(data, at + 2)
        (width,) = struct.unpack_from("<H", data, at)
        at += 2
        if width > _MOST_VARIABLES:
            raise ValueError("too many variables")
        names, kinds = [], ""
        for _ in range(width):
            # A name and the letter of its type in brackets.
            name, at = _name(data, at)
            if name[-3:-2] != "(" or name[-2] not in _TYPES:
                raise ValueError("a variable without a type")
            names.append(name[:-3])
            kinds += name[-2]
        events[number] = _Event(struct.Struct(f"<{kinds}"), tuple(names))
    return version, events, at


def _name(data: bytes, at: int) -> tuple[str, int]:
    """The text up to the next zero, and what is behind it."""
    end = data.index(0, at, at + _LONGEST_NAME)
    return data[at:end].decode("utf-8", "replace"), end + 1


def _logged(data: bytes, version: int, events: dict[int, _Event], at: int) -> dict[int, Values]:
    """The values of each event's variables and of "time", up to the end or the first event that was not described."""
    stamp = _STAMPS[version][0]
    rows: dict[int, list[tuple[float, ...]]] = defaultdict(list)
    end = len(data) - 4
    while at + stamp.size <= end:
        number, time = stamp.unpack_from(data, at)
        event = events.get(number)
        at += stamp.size
        if event is None or at + event.row.size > end:
            break
        rows[number].append((time, *event.row.unpack_from(data, at)))
        at += event.row.size
    return {
        number: dict(zip(("time", *events[number].variables), map(list, zip(*found, strict=True)), strict=True))
        for number, found in rows.items()
        if len(set(events[number].variables)) == len(events[number].variables)
    }
