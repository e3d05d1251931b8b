"""ArduPilot's DataFlash logs (.BIN), by pymavlink: the estimator's position north and east, and its yaw."""

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.boot_clock import booted_at, unix_of_gps
from mtm_audit.readers.logs.choosing import check_topics
from mtm_audit.readers.logs.earth import north_east_m
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import headings_at
from mtm_onboard.protocol.errors import MtmError

WHAT = "an ArduPilot DataFlash log"
# Estimators of version 3 and 2, which count cores, and positions by latitude and longitude.
_ESTIMATES, _GLOBAL = ("XKF1", "NKF1"), ("POS", "GPS")
_FIX_3D = 3
_HEAD_BYTES = 3


def recognises_dataflash(opening: Opening) -> bool:
    """Whether it begins with the head of a message of formats."""
    return opening.start.startswith(b"\xa3\x95\x80")


def read_dataflash(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The body by the estimator's first core, or by the messages asked for (`XKF1.1`, `POS`), by time since boot.

    The Unix time of boot is the median over the GPS records, of which the first is often late.
    """
    reader = library("pymavlink.DFReader", path, WHAT)
    with foreign(path, WHAT):
        with closing(_quiet(reader)(path)) as log:
            rows = _rows(log)
        present = [name for kind in (*_ESTIMATES, *_GLOBAL) for name in sorted(rows) if name.partition(".")[0] == kind]
        if options.topics:
            check_topics(path, options.topics, present)
        if not present:
            raise MtmError(f"{path} is {WHAT} without a position (XKF1, NKF1, POS or GPS); let the vehicle log one")
        first = present[0]
        others = [name for name in present if name != first and name.partition(".")[0] == first.partition(".")[0]]
        if others and not options.topics:
            warn(f"{path} has further instances: {', '.join(others)}; {first} was read, and --topic chooses others")
        chosen = {name: name for name in options.topics} or {path.stem: first}
        bodies = tuple(_body(name, rows[topic], rows, options) for name, topic in chosen.items())
        return Log(bodies, at=_booted_at(rows))


def _quiet(module: Any) -> Any:
    """The library's reader without its compiled index, which writes past Python to standard error.

    It closes the file also where it cannot be indexed, and takes no format of messages that is shorter than their head.
    """

    class Quiet(module.DFReader_binary):  # type: ignore[misc]
        formats: dict[int, Any]

        def __init__(self, path: Path) -> None:
            try:
                super().__init__(str(path), zero_time_base=False)
            except Exception:
                for opened in ("data_map", "filehandle"):
                    if hasattr(self, opened):
                        getattr(self, opened).close()
                raise

        def init_arrays_fast(self, progress_callback: Any = None) -> None:
            self.init_arrays(progress_callback)

        def init_arrays(self, progress_callback: Any = None) -> None:
            self.formats = _Formats(self.formats)
            super().init_arrays(progress_callback)

    return Quiet


class _Formats(dict[int, Any]):
    """Formats of messages by their numbers, each at least as long as the head that every message has."""

    def __setitem__(self, number: int, form: Any) -> None:
        if form.len < _HEAD_BYTES:
            raise ValueError(f"messages {form.name} are said to have {form.len} bytes")
        super().__setitem__(number, form)


def _rows(log: Any) -> dict[str, list[Any]]:
    """Messages by type, and by instance where a type has several."""
    kinds = [*_ESTIMATES, *_GLOBAL, "NKF6", "ATT"]
    rows: dict[str, list[Any]] = {}
    while (message := log.recv_match(type=kinds)) is not None:
        kind = message.get_type()
        instance = (
            getattr(message, "C", None)
            if kind in _ESTIMATES
            else getattr(message, "I", None)
            if kind == "GPS"
            else None
        )
        # Before cores were numbered, NKF6 was the second one's NKF1.
        name = "NKF1.1" if kind == "NKF6" else f"{kind}.{instance}" if instance else kind
        rows.setdefault(name, []).append(message)
    return rows


def _body(name: str, messages: list[Any], rows: dict[str, list[Any]], options: ReadOptions) -> Body:
    times_s = _column(messages, "TimeUS") * options.seconds("us")
    if hasattr(messages[0], "PN"):
        place = [_column(messages, part) for part in ("PN", "PE", "PD")]
        turns = -np.deg2rad(_column(messages, "Yaw"))
    else:
        north_m, east_m = north_east_m(_column(messages, "Lat"), _column(messages, "Lng"))
        place = [north_m, east_m, -_column(messages, "Alt")]
        attitudes = rows.get("ATT", [])
        known_s = _column(attitudes, "TimeUS") * options.seconds("us")
        turns = headings_at(times_s, known_s, -np.deg2rad(_column(attitudes, "Yaw")))
    positions_m = np.stack(place, axis=1) * options.metres()
    return Body(name, times_s, positions_m, headings_rad=turns, up=options.up or "-z")


def _column(messages: list[Any], field: str) -> Floats:
    return np.array([getattr(message, field, np.nan) for message in messages], dtype=float)


def _booted_at(rows: dict[str, list[Any]]) -> RecordedAt | None:
    fixes = [fix for fix in rows.get("GPS", []) if getattr(fix, "Status", 0) >= _FIX_3D and getattr(fix, "GWk", 0) > 0]
    return booted_at(_column(fixes, "TimeUS") * 1e-6, unix_of_gps(_column(fixes, "GWk"), _column(fixes, "GMS")))
