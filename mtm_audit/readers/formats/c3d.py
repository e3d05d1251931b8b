"""C3D: rigid bodies of named markers, by ezc3d."""

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.libraries import foreign, missing
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import AXES, METRES, ReadOptions
from mtm_audit.readers.logs.rigid import grouped, rigid_body
from mtm_onboard.protocol.errors import MtmError

WHAT = "a C3D file"
# The header counts frames in 16 bits, so what is longer is cut by one program and padded by another.
_LONGEST_FRAMES = 65_535
# The library takes about thirty times a file's size, and less than a second for its largest files.
_SECONDS, _SECONDS_PER_MEGABYTE = 20, 2
_MEGABYTES, _TIMES_FILE = 4096, 64


@dataclass(frozen=True)
class _Markers:
    """Points (4, markers, n) and residuals (markers, n) as they are in the file, and what it says of them."""

    points: Floats
    residuals: Floats
    labels: list[str]
    rate_hz: float
    unit: str
    up: str


def recognises_c3d(opening: Opening) -> bool:
    """Whether it begins with the number of its first block of parameters, which is small, and the format's mark."""
    return len(opening.start) >= 512 and opening.start[1] == 0x50 and 2 <= opening.start[0] <= 20


def read_c3d(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """Bodies of the markers before a colon or a number (Rover:1, Rover_Marker1), or as `options.bodies` name them.

    Lengths are of the parameter POINT:UNITS, times frames over POINT:RATE, and the z axis points up unless
    POINT:Y_SCREEN says otherwise. A NaN or a residual below zero is unseen.
    """
    markers = _markers(path)
    frames = markers.points.shape[2]
    if not markers.points.shape[1] or not frames:
        raise MtmError(f"{path} is {WHAT} without a marker; export the markers")
    if not (np.isfinite(markers.rate_hz) and markers.rate_hz > 0.0):
        raise MtmError(f"{path} is {WHAT} whose rate is {markers.rate_hz:g} frames a second; export it again")
    if frames >= _LONGEST_FRAMES:
        warn(f"{path} has as many frames as the format can count; if the recording went on, save it in pieces")
    unit_m = options.metres(markers.unit if markers.unit in METRES else None)
    markers_m = np.moveaxis(markers.points[:3], 0, -1).swapaxes(0, 1) * unit_m
    markers_m[(markers.residuals.T < 0.0) | ~np.all(np.isfinite(markers_m), axis=2)] = np.nan
    up = options.up or (markers.up if markers.up in AXES else "z")
    times_s = np.arange(frames) / markers.rate_hz
    bodies = [
        rigid_body(name, times_s, markers_m[:, members], up, str(path), warn)
        for name, members in grouped(markers.labels, options.bodies, str(path)).items()
        if np.any(np.isfinite(markers_m[:, members]))
    ]
    if not bodies:
        raise MtmError(f"{path} is {WHAT} in which no marker was seen; export it again")
    return Log(tuple(bodies))


def _markers(path: Path) -> _Markers:
    """The file's markers, read by another process that may be bounded."""
    if _is_missing("ezc3d"):
        raise missing("ezc3d", path, WHAT)
    megabytes = path.stat().st_size >> 20
    with tempfile.TemporaryDirectory() as folder, foreign(path, WHAT):
        out = Path(folder) / "points.npz"
        # Without -P a file of the recording's folder could take the place of a library.
        command = [sys.executable, "-P", "-m", "mtm_audit.readers.formats.c3d_points", str(path.absolute()), str(out)]
        try:
            done = subprocess.run(
                [*command, str(_MEGABYTES + _TIMES_FILE * megabytes)],
                stdin=subprocess.DEVNULL, capture_output=True, check=False, cwd=folder,
                timeout=_SECONDS + _SECONDS_PER_MEGABYTE * megabytes,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise ValueError("its library does not come to an end") from None
        if done.returncode or not out.is_file():
            lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
            raise ValueError(lines[-1] if lines else f"its library ended with code {done.returncode}")
        with np.load(out) as data:
            up = str(data["up"]).lstrip("+")
            labels = [str(label) for label in data["labels"]]
            return _Markers(data["points"], data["residuals"], labels, float(data["rate_hz"]), str(data["unit"]), up)


def _is_missing(module: str) -> bool:
    try:
        return find_spec(module) is None
    except ValueError:
        # What was taken out of the list of modules has no description.
        return True
