"""A film of two simulated robots that send, and copies of it in other codecs and containers."""

from dataclasses import dataclass, field
from fractions import Fraction

import av
import numpy as np

from hil.sensors.camera import Camera, film
from hil.sensors.optics import overhead
from hil.sensors.poses import Trajectory
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1, 1), ticks=200))
SYMBOLS, MESSAGE = (3, 1), 13
SECONDS, ONSET_S = 9.0, 0.5
CAMERA = Camera(optics=overhead(width_px=640, height_px=640), noise_levels=1.0, blur_px=0.6)


def trajectories(key=KEY, symbols=SYMBOLS, seconds=SECONDS):
    """Where the robots are; `symbols` may be None for robots that send nothing."""
    found = []
    for number, channel in enumerate(key.scheme.channels):
        own = None if symbols is None else (symbols[number],)
        track = robot_track(key, channel.name, own, seconds, onset_s=ONSET_S, seed=number)
        found.append(Trajectory(channel.body, track.times_s, track.positions, np.zeros(len(track.times_s))))
    return found


def film_robots(path, *, camera=CAMERA, crf=8, **sent):
    """Film them as H.264 in MP4."""
    write_video(film(camera, Scene(), trajectories(**sent), np.random.default_rng(1)), path, camera.rate_hz, crf)
    return path


@dataclass(frozen=True, kw_only=True)
class Copy:
    """How a film is encoded anew; `format` None goes by the suffix."""

    suffix: str
    codec: str
    options: dict[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv420p"
    format: str | None = None


def transcode(source, target, copy, *, speed=1.0, every=1, offset_s=0.0):
    """Encode a film anew, its times divided by `speed` and moved; keeps one frame of `every` so many."""
    with av.open(str(source)) as before, av.open(str(target), "w", format=copy.format) as after:
        stream = before.streams.video[0]
        encoder = after.add_stream(copy.codec, rate=30, options=copy.options)
        encoder.width, encoder.height, encoder.pix_fmt = stream.width, stream.height, copy.pixel_format
        for number, picture in enumerate(before.decode(stream)):
            if number % every:
                continue
            shown = picture.reformat(format=copy.pixel_format)
            shown.pts = round((picture.time / speed + offset_s) * 30)
            shown.time_base = Fraction(1, 30)
            shown.pict_type = av.video.frame.PictureType.NONE
            after.mux(encoder.encode(shown))
        after.mux(encoder.encode(None))
    return target
