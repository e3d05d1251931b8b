"""Telemetry logs (.tlog) of ground stations: MAVLink 1 and 2 packets, each behind the station's time, by pymavlink."""

import struct
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.boot_clock import booted_at
from mtm_audit.readers.logs.choosing import check_topics
from mtm_audit.readers.logs.earth import north_east_m
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import headings_at
from mtm_audit.readers.text import check_readable
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened

WHAT = "a MAVLink telemetry log"
_STAMP, _VERSION_1, _VERSION_2 = 8, 0xFE, 0xFD
_EARLIEST_US, _LATEST_US = 1e15, 4e15
_LARGEST_BYTES = 4 << 30
# Messages by number: positions in the order in which they are taken, then what else is needed.
_POSITIONS = {32: "LOCAL_POSITION_NED", 331: "ODOMETRY", 33: "GLOBAL_POSITION_INT"}
_NEEDED = {**_POSITIONS, 30: "ATTITUDE", 2: "SYSTEM_TIME"}
# MAV_FRAME_LOCAL_ENU and MAV_FRAME_LOCAL_FLU; all others of ODOMETRY point down.
_UPRIGHT_FRAMES = (4, 21)
# A clock that falls behind by more began anew.
_REBOOT_S = 1.0

Message = tuple[float, Any]
Systems = dict[int, dict[str, list[Message]]]


def recognises_tlog(opening: Opening) -> bool:
    """Whether it begins with a time since the Unix epoch in microseconds and the first byte of a packet."""
    return len(opening.start) > _STAMP and _packet_length(opening.start, 0) > 0


def read_tlog(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """A body for each system by its local position, or by the messages asked for, in the ground station's time.

    Instants are those of the messages' own time since boot, put on the station's clock by the median of what lies
    between; `options.arrival_times` takes the station's. Raises MtmError when no message has a position.
    """
    dialect = library("pymavlink.dialects.v20.common", path, WHAT, "logs")
    check_readable(path)
    with opened(path, "the recording") as file:
        data = file.read(_LARGEST_BYTES)
    with foreign(path, WHAT):
        systems, broken = _systems(data, dialect)
        if broken:
            warn(f"{path}: {broken} places between packets are damaged and were left out")
        present = [name for name in _POSITIONS.values() if any(name in kinds for kinds in systems.values())]
        check_topics(path, options.topics, present)
        if not present:
            raise MtmError(f"{path} is {WHAT} without a position; let the vehicle send LOCAL_POSITION_NED")
        bodies = []
        for number, kinds in sorted(systems.items()):
            topics = options.topics or [name for name in present if name in kinds][:1]
            for topic in (topic for topic in topics if topic in kinds):
                bodies.append(_body(_name(path, number, topic, systems, options), kinds, topic, options))
        return Log(tuple(bodies), at=_station_at(systems))


def _name(path: Path, number: int, topic: str, systems: Systems, options: ReadOptions) -> str:
    several = sum(any(name in kinds for name in _POSITIONS.values()) for kinds in systems.values()) > 1
    system = f"system{number}" if several else path.stem
    return f"{system}.{topic}" if len(options.topics) > 1 else system


def _packet_length(data: bytes, at: int) -> int:
    """Bytes of the packet behind the time at `at`; 0 when none is there."""
    if len(data) < at + _STAMP + 3:
        return 0
    stamp, magic = struct.unpack_from(">QB", data, at)
    if not _EARLIEST_US < stamp < _LATEST_US:
        return 0
    if magic == _VERSION_1:
        return 8 + data[at + _STAMP + 1]
    if magic == _VERSION_2:
        return 12 + data[at + _STAMP + 1] + (13 if data[at + _STAMP + 2] & 1 else 0)
    return 0


def _packets(data: bytes, tell_broken: Callable[[], None]) -> Iterator[tuple[float, bytes]]:
    """The station's times in seconds and the packets; what is between them is skipped."""
    at, lost = 0, False
    while at + _STAMP < len(data):
        length = _packet_length(data, at)
        if not length:
            if not lost:
                tell_broken()
            lost, at = True, at + 1
            continue
        lost = False
        yield struct.unpack_from(">Q", data, at)[0] * 1e-6, data[at + _STAMP : at + _STAMP + length]
        at += _STAMP + length


def _systems(data: bytes, dialect: Any) -> tuple[Systems, int]:
    """Messages by system and name, each with the station's time; and how many places or packets were broken.

    The dialect of version 2 reads packets of both versions, where the library's own opening of a log stays with that
    of its first packet.
    """
    broken: Counter[str] = Counter()
    reader = dialect.MAVLink(None)
    systems: Systems = defaultdict(lambda: defaultdict(list))
    for unix_s, packet in _packets(data, lambda: broken.update(["place"])):
        old = packet[0] == _VERSION_1
        number = packet[5] if old and len(packet) > 5 else int.from_bytes(packet[7:10], "little")
        if number not in _NEEDED:
            continue
        try:
            message = reader.decode(bytearray(packet))
        except (dialect.MAVError, struct.error, IndexError):
            broken.update(["packet"])
            continue
        systems[message.get_srcSystem()][_NEEDED[number]].append((unix_s, message))
    return systems, broken.total()


def _body(name: str, kinds: dict[str, list[Message]], topic: str, options: ReadOptions) -> Body:
    messages = kinds[topic]
    times_s = _times_s(messages, options)
    if topic == "ODOMETRY":
        quaternions = np.array([[m.q[1], m.q[2], m.q[3], m.q[0]] for _, m in messages])
        up = "z" if messages[0][1].frame_id in _UPRIGHT_FRAMES else "-z"
        return Body(name, times_s, _place(messages) * options.metres(), quaternions, up=options.up or up)
    if topic == "GLOBAL_POSITION_INT":
        north_m, east_m = north_east_m(_column(messages, "lat") * 1e-7, _column(messages, "lon") * 1e-7)
        positions_m = np.stack([north_m, east_m, -_column(messages, "alt") * 1e-3], axis=1)
        hundredths = _column(messages, "hdg")
        headings = -np.deg2rad(np.where(hundredths == 65_535, np.nan, hundredths) * 0.01)
    else:
        positions_m = _place(messages) * options.metres()
        attitudes = kinds.get("ATTITUDE", [])
        headings = headings_at(times_s, _times_s(attitudes, options), -_column(attitudes, "yaw"))
    return Body(name, times_s, positions_m, headings_rad=headings, up=options.up or "-z")


def _place(messages: list[Message]) -> Floats:
    return np.array([[m.x, m.y, m.z] for _, m in messages], dtype=float)


def _column(messages: list[Message], field: str) -> Floats:
    return np.array([getattr(message, field) for _, message in messages], dtype=float)


def _times_s(messages: list[Message], options: ReadOptions) -> Floats:
    """Instants of the messages on the station's clock; after a reboot the vehicle's clock is put there anew."""
    arrivals_s = np.array([unix_s for unix_s, _ in messages])
    if options.arrival_times or not messages:
        return arrivals_s
    boots_s = _boots_s(messages)
    parts = np.concatenate([[0], np.cumsum(np.diff(boots_s) < -_REBOOT_S)])
    times_s = np.empty(len(boots_s))
    for part in np.unique(parts):
        here = parts == part
        times_s[here] = boots_s[here] + np.median(arrivals_s[here] - boots_s[here])
    return times_s


def _boots_s(messages: list[Message]) -> Floats:
    odometry = messages[0][1].get_type() == "ODOMETRY"
    return _column(messages, "time_usec") * 1e-6 if odometry else _column(messages, "time_boot_ms") * 1e-3


def _station_at(systems: Systems) -> RecordedAt:
    """How far the station's clock is from that of the vehicles' GPS; as it says itself where they have none."""
    told = [item for kinds in systems.values() for item in kinds.get("SYSTEM_TIME", [])]
    utc_s = np.array([message.time_unix_usec * 1e-6 for _, message in told])
    return booted_at(np.array([unix_s for unix_s, _ in told]), utc_s) or RecordedAt(0.0)
