"""A software camera: exposes the scene at its own, possibly irregular, instants."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.sensors import textures
from hil.sensors.camera_motion import CameraMotion
from hil.sensors.optics import Optics, overhead
from hil.sensors.poses import Floats, Occlusion, Trajectory, common_span_s, occluded
from hil.sensors.scene import Painter, Scene, Sighting
from mtm_audit.model.picture import Frame, Image
from mtm_onboard.protocol.errors import MtmError

NOISE_SLACK_PX = 64


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Optics, shutter and sensor.

    Frames come every 1 / `rate_hz`, moved by Gaussian `jitter_s` (cut at 0.45 periods) and lost with
    `drop_probability`; a frame's time is the middle of its exposure. `exposure_s` above zero blurs motion as the mean
    of `sub_exposures`. `blur_px` is the lens' Gaussian blur, `noise_levels` the sensor's noise, both standard
    deviations. A robot inside one of `occlusions` (world time) is hidden under a cloth. `motion` None is a camera on a
    stand.
    """

    optics: Optics = field(default_factory=overhead)
    rate_hz: float = 30.0
    jitter_s: float = 0.0
    drop_probability: float = 0.0
    exposure_s: float = 0.0
    sub_exposures: int = 4
    blur_px: float = 0.0
    noise_levels: float = 0.0
    occlusions: tuple[Occlusion, ...] = ()
    motion: CameraMotion | None = None


def frame_times(camera: Camera, duration_s: float, rng: np.random.Generator) -> Floats:
    """Times of the frames that survive, shape (n,), in seconds from the start of the recording."""
    period_s = 1 / camera.rate_hz
    nominal_s = np.arange(int(duration_s * camera.rate_hz + 1e-6) + 1) * period_s
    bound_s = 0.45 * period_s
    jitter_s = np.clip(camera.jitter_s * rng.standard_normal(len(nominal_s)), -bound_s, bound_s)
    kept = rng.random(len(nominal_s)) >= camera.drop_probability
    return np.clip(nominal_s + jitter_s, 0.0, duration_s)[kept]


def film(
    camera: Camera,
    scene: Scene,
    trajectories: list[Trajectory],
    rng: np.random.Generator,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Iterator[Frame]:
    """Film all robots from `start_s` to `end_s` of world time (default: the span that all trajectories cover).

    Frame times count from the start of the recording. Robot number k of the list carries marker or colour k. Raises
    MtmError when there are more robots than markers.
    """
    if scene.colours_bgr is None and len(trajectories) > 50:
        raise MtmError(f"{len(trajectories)} robots need more than the 50 markers there are; film fewer of them")
    first_s, last_s = common_span_s(trajectories)
    first_s, last_s = first_s if start_s is None else start_s, last_s if end_s is None else end_s
    times_s = frame_times(camera, last_s - first_s, rng)
    noise = _noise_field(camera, rng)
    painter = Painter(scene, camera.optics, camera.blur_px)
    tops, cloth = [scene.top(number) for number in range(len(trajectories))], textures.covered_top()
    shutter_s = _shutter(camera)
    instants_s = first_s + (times_s[:, None] + shutter_s).ravel()
    poses = [np.column_stack(robot.at(instants_s)).reshape(-1, len(shutter_s), 3) for robot in trajectories]
    hidden = [occluded(camera.occlusions, robot.name, first_s + times_s) for robot in trajectories]
    aims = None
    if camera.motion is not None:
        aims = camera.motion.turned(camera.optics, instants_s - first_s, last_s - first_s, rng)
    for index, time_s in enumerate(times_s):
        sightings = [
            Sighting(cloth if hidden[number][index] else top, poses[number][index]) for number, top in enumerate(tops)
        ]
        if aims is None:
            picture = painter.paint(sightings)
        else:
            own = slice(index * len(shutter_s), (index + 1) * len(shutter_s))
            picture = _exposed_in_motion(painter, sightings, aims[own])
        yield Frame(float(time_s), _with_noise(picture, noise, rng))


def _exposed_in_motion(painter: Painter, sightings: list[Sighting], aims: list[Optics]) -> Image:
    """The mean of what each part of the exposure shows."""
    layers = []
    for part, optics in enumerate(aims):
        painter.aim(optics)
        layers.append(painter.paint([Sighting(one.top, one.poses[part : part + 1]) for one in sightings]))
    if len(layers) == 1:
        return layers[0]
    return np.asarray(np.mean(layers, axis=0, dtype=np.float32) + 0.5, dtype=np.uint8)


def top_pixels(optics: Optics, positions_xy_m: Floats) -> Floats:
    """Where the middles of the robots' tops appear, pixels (n, 2), x to the right and y down."""
    return optics.project(np.insert(positions_xy_m, 2, textures.ROBOT_HEIGHT_M, axis=1))


def _shutter(camera: Camera) -> Floats:
    """Instants of the sub-exposures relative to the middle of the exposure."""
    if camera.exposure_s <= 0:
        return np.zeros(1)
    return camera.exposure_s * ((np.arange(camera.sub_exposures) + 0.5) / camera.sub_exposures - 0.5)


def _noise_field(camera: Camera, rng: np.random.Generator) -> NDArray[np.int16] | None:
    if camera.noise_levels <= 0:
        return None
    shape = (camera.optics.height_px + NOISE_SLACK_PX, camera.optics.width_px + NOISE_SLACK_PX, 3)
    return np.round(camera.noise_levels * rng.standard_normal(shape)).astype(np.int16)


def _with_noise(picture: Image, noise: NDArray[np.int16] | None, rng: np.random.Generator) -> Image:
    """Add a randomly placed cut-out of the noise field: fresh noise for every frame would cost more than all else."""
    if noise is None:
        return picture
    row, column = rng.integers(0, NOISE_SLACK_PX, 2)
    cutout = noise[row : row + picture.shape[0], column : column + picture.shape[1]]
    return np.asarray(cv2.add(picture, cutout, dtype=cv2.CV_8U), dtype=np.uint8)
