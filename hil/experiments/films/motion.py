"""How much of a small motion is left in a film, by codec, quality and size of the motion.

One cell is one marker of 60 pixels that moves as noise of 0.5 to 5 Hz on a still floor, filmed and encoded. What the
tracker measures is compared with where the marker was.
"""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hil.experiments.films.coding import CODINGS, LOSSLESS
from hil.experiments.runs.cells import Scalar, Values
from hil.sensors.camera import Camera, film
from hil.sensors.film_qualities import write_quality
from hil.sensors.optics import overhead
from hil.sensors.poses import Floats, Trajectory
from hil.sensors.scene import Scene
from hil.sensors.textures import MARKER_M
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.aruco import ArucoTracker
from mtm_onboard.protocol import MtmError

_STREAM = 1505
_SECONDS, _RATE_HZ = 12.0, 30.0
_MARKER_PX, _SIDE_PX = 60.0, 256
_LOW_HZ, _HIGH_HZ = 0.5, 5.0
MOTIONS_PX = (0.03, 0.1, 0.3)


def kept_under_all(parameters: Values, seed: int) -> dict[str, Scalar]:
    """For each coding the correlation of the measured with the true motion, its gain, and the film's bits a pixel.

    `parameters` is `motion_px`, the root mean square along each axis. A film without a readable marker keeps nothing.
    """
    pixels_per_metre = _MARKER_PX / MARKER_M
    times_s = np.arange(round(_SECONDS * 200) + 1) / 200
    draw = np.random.default_rng([_STREAM, seed])
    moved_m = float(parameters["motion_px"]) / pixels_per_metre * _noise(times_s, draw)
    # Turned off the pixel grid, as markers are.
    robot = Trajectory("robot0", times_s, moved_m, np.full(len(times_s), 0.3))
    optics = overhead(_SIDE_PX / pixels_per_metre, width_px=_SIDE_PX, height_px=_SIDE_PX)
    camera = Camera(optics=optics, rate_hz=_RATE_HZ, noise_levels=1.5, blur_px=0.6)
    result: dict[str, Scalar] = {}
    with TemporaryDirectory() as folder:
        whole, copy = Path(folder) / "whole.mp4", Path(folder) / "copy.mp4"
        write_quality(_filmed(camera, robot, draw), whole, _RATE_HZ, LOSSLESS)
        for coding in CODINGS:
            count = write_quality(read_frames(whole, "bgr"), copy, _RATE_HZ, coding.film)
            correlation, gain = _kept(copy, times_s, moved_m * pixels_per_metre * coding.film.scale)
            result[f"{coding.name} kept"] = correlation
            result[f"{coding.name} gain"] = gain
            size_bits = 8.0 * copy.stat().st_size
            result[f"{coding.name} bits a pixel"] = size_bits / count / (_SIDE_PX * coding.film.scale) ** 2
    return result


def _filmed(camera: Camera, robot: Trajectory, draw: np.random.Generator) -> Iterator[Frame]:
    return film(camera, Scene(), [robot], draw)


def _noise(times_s: Floats, draw: np.random.Generator) -> Floats:
    """Two axes (n, 2) of unit mean square with equal power at all tones of the band."""
    tones_hz = np.arange(_LOW_HZ, _HIGH_HZ, 1.0 / _SECONDS)
    phases = draw.uniform(0.0, 2.0 * np.pi, (2, len(tones_hz)))
    waves = np.cos(2.0 * np.pi * tones_hz * times_s[:, None, None] + phases)
    return np.asarray(np.sqrt(2.0 / len(tones_hz)) * waves.sum(axis=2))


def _kept(path: Path, times_s: Floats, true_px: Floats) -> tuple[float, float]:
    """Correlation and gain of the tracked motion over both axes."""
    try:
        (track,) = ArucoTracker().track(read_frames(path))
    except (MtmError, ValueError):
        return 0.0, 0.0
    seen = track.positions[track.valid]
    instants_s = track.times_s[track.valid]
    true = np.stack([np.interp(instants_s, times_s, true_px[:, axis]) for axis in range(2)], axis=1)
    seen, true = seen - seen.mean(axis=0), true - true.mean(axis=0)
    product, power = float(np.sum(seen * true)), float(np.sum(true * true))
    return product / float(np.sqrt(power * np.sum(seen * seen))), product / power
