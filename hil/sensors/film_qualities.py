"""The films that people have: what phones, action cameras, surveillance and messengers write.

Bit rates are given per pixel, so that a smaller picture is coded as coarsely as the camera's own. Encoders in hardware
use no B-frames and search little for motion, which the presets follow.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from hil.sensors.encoding import Encoding
from hil.sensors.video import encode_video
from mtm_audit.model.picture import Frame, Image
from mtm_audit.readers.video import read_frames

_HARDWARE_H264 = {"preset": "superfast", "bf": "0", "tune": "zerolatency"}
_HARDWARE_HEVC = {"preset": "ultrafast", "x265-params": "log-level=none:bframes=0"}


@dataclass(frozen=True, kw_only=True)
class FilmQuality:
    """`encoding` of the file; one picture of `every` is kept; `scale` is its width over the camera's.

    `copy_of` is the quality of the film that this one was made from by a program that decoded and encoded it anew.
    """

    encoding: Encoding
    every: int = 1
    scale: float = 1.0
    copy_of: "FilmQuality | None" = None


_PHONE = FilmQuality(
    # iPhones take about 60 MB for a minute of 1080p at 30 pictures a second in HEVC (Settings, Camera, Record Video).
    encoding=Encoding(codec="libx265", options=_HARDWARE_HEVC, bits_per_pixel=0.13, key_every_s=1.0)
)
FILM_QUALITIES: dict[str, FilmQuality] = {
    "phone": _PHONE,
    # The GoPro HD HERO writes 15 Mbit/s of H.264 for 1080p at 30 pictures a second (its manual); later ones write more.
    "action-camera": FilmQuality(
        encoding=Encoding(options=_HARDWARE_H264, bits_per_pixel=0.24, key_every_s=0.5),
    ),
    # A guide for installers: 3 Mbit/s of H.264 for 1080p at 15 pictures a second (unifore.net, "IP camera bitrate
    # setting"); makers' manuals have a key frame every two seconds (Cantek CT-IPC).
    "surveillance": FilmQuality(
        encoding=Encoding(options=_HARDWARE_H264, bits_per_pixel=0.096, key_every_s=2.0), every=2
    ),
    # A phone's film at about 1 Mbit/s and 848 x 480, in the H.264 Main profile without B-frames that WhatsApp asks for
    # (its developer documentation, Video Messages).
    "messenger": FilmQuality(
        encoding=Encoding(
            options={"preset": "veryfast", "profile": "main", "bf": "0"}, bits_per_pixel=0.082, key_every_s=3.0
        ),
        scale=848 / 1920,
        copy_of=_PHONE,
    ),
}


def write_quality(
    frames: Iterable[Frame], path: Path, rate_hz: float, quality: FilmQuality, began_unix_s: float | None = None
) -> int:
    """Write the frames of a camera of that rate as such a film; returns the number of those written.

    Raises MtmError as `encode_video` does.
    """
    if quality.copy_of is None:
        return encode_video(_taken(frames, quality), path, rate_hz / quality.every, quality.encoding, began_unix_s)
    with TemporaryDirectory() as folder:
        first = Path(folder) / "first.mp4"
        write_quality(frames, first, rate_hz, quality.copy_of)
        pictures = read_frames(first, "bgr")
        return encode_video(_taken(pictures, quality), path, rate_hz / quality.every, quality.encoding, began_unix_s)


def _taken(frames: Iterable[Frame], quality: FilmQuality) -> Iterator[Frame]:
    for number, frame in enumerate(frames):
        if number % quality.every == 0:
            yield Frame(frame.time_s, _scaled(frame.image, quality.scale))


def _scaled(image: Image, scale: float) -> Image:
    """The picture in that size, its sides even numbers of pixels."""
    if scale == 1.0:
        return image
    height, width = (2 * round(scale * side / 2) for side in image.shape[:2])
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
