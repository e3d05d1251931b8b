"""One message filmed from the side, or through a wide lens: what straightening and the view from above are worth.

All conditions of a seed film the same run, and each film is tracked once and read in four ways.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hil.experiments.cameras.filmed import FRAME_RATE_HZ, STREAM, sent_run
from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.sensors.camera import Camera, film
from hil.sensors.cameras import FLOORS
from hil.sensors.optics import Optics
from hil.sensors.video import write_video
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.lens import Lens
from mtm_audit.model.track import Track
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.ground_plane import from_above
from mtm_audit.tracking.lens import straightened_track
from mtm_audit.tracking.registry import tracker

# A lens as robots have it, and one without distortion that shows as much at the picture's middle.
LENSES = {"pinhole": (0.0, 0.0), "wide": (-0.3, 0.1)}
SIZE_PX, FOCAL_PX = (1280, 960), 860.0
# From the middle of the floor: so that the whole arena is in sight from the side, and most of it from above.
OBLIQUE_M, OVERHEAD_M = 4.5, 3.0
WAYS = ("plain", "straightened", "above", "both")


@dataclass(frozen=True)
class View:
    """How far the camera looks from straight down, and through which of the LENSES."""

    tilt_deg: float
    lens: str


VIEWS = (
    View(0.0, "wide"),
    *(View(tilt_deg, lens) for tilt_deg in (60.0, 65.0, 70.0) for lens in LENSES),
)


def tilted_cells(rollouts: int, seed: int) -> list[list[Cell]]:
    """The cells of each view."""
    return [[Cell("tilts", asdict(view), seed + row) for row in range(rollouts)] for view in VIEWS]


def film_and_read(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Evidence in nats of one film, by each of the WAYS."""
    view = View(**parameters)  # type: ignore[arg-type]
    optics = _optics(view)
    key, _, run = sent_run(seed)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        camera = Camera(optics=optics, rate_hz=FRAME_RATE_HZ, noise_levels=1.0, blur_px=0.6)
        frames = film(camera, FLOORS["mat"], list(run.trajectories), np.random.default_rng([STREAM, seed]))
        write_video(frames, path, FRAME_RATE_HZ)
        plain = tracker("aruco").track(read_frames(path))
    ways = zip(WAYS, _ways(plain, _lens(optics)), strict=True)
    return {way: decode_tracks(tracks, key, DecodeSettings()).evidence.nats or 0.0 for way, tracks in ways}


def _ways(plain: list[Track], lens: Lens) -> tuple[list[Track], ...]:
    straight = [straightened_track(track, lens, flipped=False) for track in plain]
    return plain, straight, from_above(plain, SIZE_PX), from_above(straight, SIZE_PX, lens)


def _optics(view: View) -> Optics:
    tilt, away_m = math.radians(view.tilt_deg), OBLIQUE_M if view.tilt_deg else OVERHEAD_M
    return Optics(
        position_m=(0.0, -away_m * math.sin(tilt), away_m * math.cos(tilt)), target_m=(0.0, 0.0, 0.0),
        focal_px=FOCAL_PX, width_px=SIZE_PX[0], height_px=SIZE_PX[1], radial=LENSES[view.lens],
    )  # fmt: skip


def _lens(optics: Optics) -> Lens:
    """What a calibration of the camera would say."""
    return Lens(
        name="simulated", size_px=SIZE_PX, focal_px=(FOCAL_PX, FOCAL_PX),
        centre_px=((SIZE_PX[0] - 1) / 2, (SIZE_PX[1] - 1) / 2), distortion=(*optics.radial, 0.0, 0.0),
    )  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One view: mean evidence in nats by each of the WAYS, over so many rollouts."""

    view: View
    nats: dict[str, float]
    rollouts: int


def rows_of(results: Sequence[Sequence[Values]]) -> list[Row]:
    """The table, from the results of each view."""
    return [
        Row(view, {way: float(np.mean([float(result[way]) for result in own])) for way in WAYS}, len(own))
        for view, own in zip(VIEWS, results, strict=True)
    ]
