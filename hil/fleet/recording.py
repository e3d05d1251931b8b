"""The recording of a run: a folder that an auditor can be given, and the truth beside it.

mocap/<robot>.tum   motion capture
video.mp4           the camera's film, unless none was wanted
truth.json          what was sent and when; holds no secret
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hil.fleet.rig import RunResult, RunSettings, seeds_of
from hil.sensors.camera import Camera, film
from hil.sensors.film_qualities import FilmQuality, write_quality
from hil.sensors.motion_capture import MotionCapture, capture, write_tum_files
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_onboard.protocol.framing import number_of_symbols


@dataclass(frozen=True)
class Sensors:
    """What records the run; `camera` None leaves the video out, `quality` None keeps it nearly as it was seen."""

    motion_capture: MotionCapture = field(default_factory=MotionCapture)
    camera: Camera | None = None
    scene: Scene = field(default_factory=Scene)
    quality: FilmQuality | None = None


def motion_capture_tracks(result: RunResult, seed: int, system: MotionCapture) -> list[Track]:
    """The tracks of all robots; times count from the start of the run."""
    return capture(system, list(result.trajectories), _generators(seed)[0])


def write_recording(
    folder: Path,
    settings: RunSettings,
    result: RunResult,
    sensors: Sensors,
    filmed: Callable[[int], None] | None = None,
) -> None:
    """Write the recording of a run into `folder`, which exists; `filmed` is called with the number of frames done."""
    mocap = folder / "mocap"
    mocap.mkdir()
    write_tum_files(motion_capture_tracks(result, settings.seed, sensors.motion_capture), mocap)
    if sensors.camera is not None:
        frames = film(sensors.camera, sensors.scene, list(result.trajectories), _generators(settings.seed)[1])
        _write_film(_counted(frames, filmed), folder / "video.mp4", sensors, settings.unix_s)
    (folder / "truth.json").write_text(json.dumps(truth(settings, result), indent=2) + "\n", encoding="utf-8")


def _write_film(frames: Iterator[Frame], path: Path, sensors: Sensors, began_unix_s: float | None) -> None:
    assert sensors.camera is not None
    rate_hz = sensors.camera.rate_hz
    if sensors.quality is None:
        write_video(frames, path, rate_hz, began_unix_s=began_unix_s)
    else:
        write_quality(frames, path, rate_hz, sensors.quality, began_unix_s)


def truth(settings: RunSettings, result: RunResult) -> dict[str, Any]:
    """What was sent, for comparison with what is decoded; `message` is None when nothing was."""
    scheme, message = settings.key.scheme, settings.message()
    return {
        "message": _message(settings),
        "symbols": None if message is None else message.symbols(settings.first_slot),
        "onset_s": None if message is None else result.onset_s,
        "unix_s": settings.unix_s,
        "seconds": settings.seconds,
        "key_id": settings.key.id,
        "scheme": scheme.name,
        "scheme_fingerprint": scheme.fingerprint,
        "seed": settings.seed,
        "robots": [{"name": robot.name, "sent": robot.sent, "missed": robot.missed} for robot in result.robots],
    }


def _message(settings: RunSettings) -> int | str | None:
    if settings.symbols is not None:
        return number_of_symbols(settings.symbols, settings.key.scheme)
    return settings.payload.hex() if isinstance(settings.payload, bytes) else settings.payload


def _generators(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """Of the motion capture and of the camera."""
    system, camera = seeds_of(seed).sensors.spawn(2)
    return np.random.default_rng(system), np.random.default_rng(camera)


def _counted(frames: Iterator[Frame], filmed: Callable[[int], None] | None) -> Iterator[Frame]:
    for number, frame in enumerate(frames, 1):
        yield frame
        if filmed is not None:
            filmed(number)
