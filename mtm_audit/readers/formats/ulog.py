"""PX4 ULog, by pyulog: local positions and headings, in metres north, east and down and microseconds since boot."""

from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn, chosen_axis
from mtm_audit.readers.logs.boot_clock import booted_at
from mtm_audit.readers.logs.choosing import check_topics
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import headings_at, headings_of_quaternions
from mtm_onboard.protocol.errors import MtmError

WHAT = "a PX4 ULog"
# What the vehicle flew by comes first, then what it was told, then what a simulator knows.
POSITIONS = (
    "vehicle_local_position", "vehicle_odometry", "estimator_local_position", "estimator_odometry",
    "vehicle_visual_odometry", "vehicle_mocap_odometry", "vehicle_local_position_groundtruth",
)  # fmt: skip
_ATTITUDE, _GPS = "vehicle_attitude", ("vehicle_gps_position", "sensor_gps")


def recognises_ulog(opening: Opening) -> bool:
    """Whether it begins with the format's magic bytes."""
    return opening.start.startswith(b"ULog\x01\x12\x35")


def read_ulog(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The body by vehicle_local_position, or by the topics asked for (`estimator_local_position.1` for an instance).

    Its clock is that of the samples since boot; the Unix time of boot is the median over the GPS records.
    """
    pyulog = library("pyulog", path, WHAT)
    with foreign(path, WHAT):
        log = pyulog.ULog(str(path), [*POSITIONS, _ATTITUDE, *_GPS])
        if log.file_corruption:
            warn(f"{path} is {WHAT} with damaged parts, which were left out")
        data = {(item.name, item.multi_id): item.data for item in log.data_list if len(item.data["timestamp"])}
        chosen = _chosen(path, data, options, warn)
        bodies = [_body(path, name, data, key, options, warn) for name, key in chosen.items()]
        return Log(tuple(bodies), at=_booted_at(data))


def _chosen(
    path: Path, data: dict[tuple[str, int], Any], options: ReadOptions, warn: Warn
) -> dict[str, tuple[str, int]]:
    """The topics to read by the name of the body that each gives."""
    present = [key for name in POSITIONS for key in sorted(data) if key[0] == name]
    names = {_name(key): key for key in present} | {f"{name}.{number}": (name, number) for name, number in present}
    if options.topics:
        check_topics(path, options.topics, list(names))
        return {topic: names[topic] for topic in options.topics}
    if not present:
        raise MtmError(f"{path} is {WHAT} without a local position; log vehicle_local_position")
    first = present[0]
    others = [_name(key) for key in present if key[0] == first[0] and key != first]
    if others:
        warn(f"{path} has further instances: {', '.join(others)}; {_name(first)} was read, and --topic chooses others")
    return {path.stem: first}


def _name(key: tuple[str, int]) -> str:
    return key[0] if key[1] == 0 else f"{key[0]}.{key[1]}"


def _body(
    path: Path, name: str, data: dict[tuple[str, int], Any], key: tuple[str, int], options: ReadOptions, warn: Warn
) -> Body:
    fields = data[key]
    fields_xyz = ("x", "y", "z") if "x" in fields else ("position[0]", "position[1]", "position[2]")
    if not set(fields_xyz) <= fields.keys():
        raise MtmError(f"{path}: {_name(key)} has no position; name another topic with --topic")
    times_s = _sampled(fields) * options.seconds("us")
    positions_m = np.stack([np.asarray(fields[part], dtype=float) for part in fields_xyz], axis=1) * options.metres()
    if "xy_valid" in fields:
        known = np.asarray(fields["xy_valid"]) != 0
        if not known.any():
            raise MtmError(f"{path}: {_name(key)} is never valid (xy_valid), the vehicle did not know where it was")
        positions_m[~known] = np.nan
    up = options.up or "-z"
    if "q[0]" in fields:
        return Body(name, times_s, positions_m, quaternions_xyzw=_quaternions(fields), up=up)
    headings, axis = _headings(data, fields, times_s, options, lambda sentence: warn(f"{path}: {sentence}"))
    return Body(name, times_s, positions_m, headings_rad=headings, up=up, heading_axis=axis)


def _headings(
    data: dict[tuple[str, int], Any], fields: Any, times_s: Floats, options: ReadOptions, warn: Warn
) -> tuple[Floats | None, str | None]:
    """Of the estimate itself, or else of the attitude at its times; clockwise from north becomes counter-clockwise.

    The axis of the body that they are of is the second; an axis that was asked for is that of the attitude.
    """
    attitude = data.get((_ATTITUDE, 0))
    if attitude is not None and "q[0]" not in attitude:
        attitude = None
    for yaw in ("heading", "yaw"):
        stated = yaw in fields and np.any(np.isfinite(fields[yaw]))
        if stated and (options.heading_axis is None or attitude is None):
            return -np.asarray(fields[yaw], dtype=float), None
    if attitude is None:
        return None, None
    quaternions = _quaternions(attitude)
    axis = chosen_axis(quaternions, "-z", options.heading_axis, f"the {options.heading_axis} axis of the vehicle", warn)
    measured_s = _sampled(attitude) * options.seconds("us")
    return headings_at(times_s, measured_s, headings_of_quaternions(quaternions, "-z", axis)), axis


def _quaternions(fields: Any) -> Floats:
    return np.stack([np.asarray(fields[f"q[{part}]"], dtype=float) for part in (1, 2, 3, 0)], axis=1)


def _sampled(fields: Any) -> Floats:
    """When the values were true, which is earlier than when they were published, where that is logged."""
    sampled = np.asarray(fields.get("timestamp_sample", fields["timestamp"]), dtype=float)
    return sampled if np.all(sampled > 0) else np.asarray(fields["timestamp"], dtype=float)


def _booted_at(data: dict[tuple[str, int], Any]) -> RecordedAt | None:
    for key in sorted(key for key in data if key[0] in _GPS and "time_utc_usec" in data[key]):
        utc_s = np.asarray(data[key]["time_utc_usec"], dtype=float) * 1e-6
        found = booted_at(np.asarray(data[key]["timestamp"], dtype=float) * 1e-6, utc_s)
        if found is not None:
            return found
    return None
