"""C3D: rigid bodies of named markers, by ezc3d."""

from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import METRES, ReadOptions
from mtm_audit.readers.logs.rigid import grouped, rigid_body
from mtm_onboard.protocol.errors import MtmError

WHAT = "a C3D file"
# The header counts frames in 16 bits, so what is longer is cut by one program and padded by another.
_LONGEST_FRAMES = 65_535


def recognises_c3d(opening: Opening) -> bool:
    """Whether it begins with the number of its first block of parameters, which is small, and the format's mark."""
    return len(opening.start) >= 512 and opening.start[1] == 0x50 and 2 <= opening.start[0] <= 20


def read_c3d(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """Bodies of the markers before a colon or a number (Rover:1, Rover_Marker1), or as `options.bodies` name them.

    Lengths are of the parameter POINT:UNITS, times frames over POINT:RATE, and the z axis points up unless
    POINT:X_SCREEN and POINT:Y_SCREEN say otherwise. A NaN or a residual below zero is unseen.
    """
    ezc3d = library("ezc3d", path, WHAT)
    with foreign(path, WHAT):
        content = ezc3d.c3d(str(path))
        point = content["parameters"]["POINT"]
        points = np.asarray(content["data"]["points"], dtype=float)
        residuals = np.asarray(content["data"]["meta_points"]["residuals"], dtype=float)[0]
        labels = _labels(content["parameters"], points.shape[1])
        rate_hz = float(np.ravel(point["RATE"]["value"])[0])
        unit, up = _word(point, "UNITS").lower(), _up(point)
    if not points.shape[1] or not points.shape[2]:
        raise MtmError(f"{path} is {WHAT} without a marker; export the markers")
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise MtmError(f"{path} is {WHAT} whose rate is {rate_hz:g} frames a second; export it again")
    if points.shape[2] >= _LONGEST_FRAMES:
        warn(f"{path} has as many frames as the format can count; if the recording went on, save it in pieces")
    markers_m = np.moveaxis(points[:3], 0, -1).swapaxes(0, 1) * options.metres(unit if unit in METRES else None)
    markers_m[(residuals.T < 0.0) | ~np.all(np.isfinite(markers_m), axis=2)] = np.nan
    return _log(path, labels, markers_m, np.arange(points.shape[2]) / rate_hz, options.up or up, options, warn)


def _log(
    path: Path, labels: list[str], markers_m: Floats, times_s: Floats, up: str, options: ReadOptions, warn: Warn
) -> Log:
    groups = grouped(labels, options.bodies, str(path))
    bodies = [
        rigid_body(name, times_s, markers_m[:, members], up, str(path), warn)
        for name, members in groups.items()
        if np.any(np.isfinite(markers_m[:, members]))
    ]
    if not bodies:
        raise MtmError(f"{path} is {WHAT} in which no marker was seen; export it again")
    return Log(tuple(bodies))


def _labels(parameters: Any, count: int) -> list[str]:
    """All labels; beyond 255 of them the format goes on in LABELS2, LABELS3 and so on."""
    point = parameters["POINT"]
    keys = ["LABELS", *(f"LABELS{number}" for number in range(2, 20))]
    found = [str(label).strip() for key in keys if key in point for label in point[key]["value"]][:count]
    return found + [f"unnamed {number}" for number in range(len(found), count)]


def _word(point: Any, key: str) -> str:
    values = list(point[key]["value"]) if key in point else []
    return str(values[0]).strip() if values else ""


def _up(point: Any) -> str:
    """The axis that points up on the screen, or z where the file does not say."""
    axis = _word(point, "Y_SCREEN").lower().lstrip("+")
    return axis if axis in ("x", "y", "z", "-x", "-y", "-z") else "z"
