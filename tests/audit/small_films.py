"""Small films of markers and coloured squares that move, drawn on the spot."""

import cv2
import numpy as np

from hil.sensors.video import write_video
from mtm_audit.model.picture import Frame
from mtm_audit.tracking.dictionaries import dictionary_of

SIZE = (320, 240)
RATE_HZ = 30.0
GRAY = 170
RED, CYAN, BLUE = (40, 40, 220), (220, 220, 30), (200, 60, 30)


def texture(size=SIZE, seed=3):
    """A floor with something on it that can be followed."""
    grain = np.random.default_rng(seed).normal(GRAY, 40.0, (size[1] // 4 + 12, size[0] // 4 + 12)).astype(np.float32)
    soft = cv2.resize(grain, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    return np.clip(cv2.GaussianBlur(soft, (0, 0), 2.0), 0, 255).astype(np.uint8)


def marker(dictionary="4x4_50", number=0, side_px=40):
    """A marker with its white margin, in colours."""
    cells = dictionary_of(dictionary).markerSize + 2
    black = cv2.aruco.generateImageMarker(dictionary_of(dictionary), number, side_px // cells * cells)
    black = cv2.resize(black, (side_px, side_px), interpolation=cv2.INTER_AREA)
    white = cv2.copyMakeBorder(black, *(side_px // 5,) * 4, cv2.BORDER_CONSTANT, value=255)
    return cv2.cvtColor(white, cv2.COLOR_GRAY2BGR)


def patch(bgr, side_px=30):
    return np.full((side_px, side_px, 3), bgr, np.uint8)


def swaying(number, seconds=2.0, rate_hz=RATE_HZ, reach_px=12.0):
    """Columns and rows (frames, 2) about a middle, each thing in its own way."""
    times_s = np.arange(round(seconds * rate_hz)) / rate_hz
    angle = 2 * np.pi * (0.9 + 0.3 * number) * times_s
    return reach_px * np.stack([np.cos(angle), np.sin(0.7 * angle)], axis=1)


def frames(things, *, seconds=2.0, rate_hz=RATE_HZ, size=SIZE, shift=None, floor=None, times_s=None):
    """Frames of `things`, each a picture, its middle (column, row) and its path about that, True for a sway of its own.

    `shift` (frames, 2) moves the camera, and `floor` lies under everything.
    """
    count = round(seconds * rate_hz)
    times_s = np.arange(count) / rate_hz if times_s is None else times_s
    paths = [_path(path, number, seconds, rate_hz) for number, (_, _, path) in enumerate(things)]
    for row, time_s in enumerate(times_s[:count]):
        ground = np.full((size[1], size[0]), GRAY, np.uint8) if floor is None else floor[: size[1], : size[0]]
        picture = cv2.cvtColor(ground, cv2.COLOR_GRAY2BGR)
        for (thing, middle, _), path in zip(things, paths, strict=True):
            paste(picture, thing, np.array(middle) + path[row])
        if shift is not None:
            move = np.array([[1.0, 0.0, shift[row, 0]], [0.0, 1.0, shift[row, 1]]])
            picture = cv2.warpAffine(picture, move, size, borderMode=cv2.BORDER_REPLICATE)
        yield Frame(float(time_s), picture)


def _path(path, number, seconds, rate_hz):
    if path is True:
        return swaying(number, seconds, rate_hz)
    return np.zeros((round(seconds * rate_hz), 2)) if path is False else path


def paste(picture, thing, middle):
    """Put the thing with its middle at a place between pixels, which must be well inside of the picture, in place."""
    height, width = thing.shape[:2]
    corner = np.array([middle[0] - (width - 1) / 2, middle[1] - (height - 1) / 2])
    left, upper = np.floor(corner).astype(int)
    move = np.array([[1.0, 0.0, corner[0] - left], [0.0, 1.0, corner[1] - upper]])
    size = width + 1, height + 1
    cover = cv2.warpAffine(np.ones((height, width), np.float32), move, size)[..., None]
    over = cv2.warpAffine(thing, move, size, borderMode=cv2.BORDER_REPLICATE)
    under = picture[upper : upper + height + 1, left : left + width + 1]
    under[:] = np.rint(under * (1 - cover) + over * cover)


def film(path, things, **how):
    """Write such a film as nearly lossless H.264 in MP4."""
    write_video(frames(things, **how), path, how.get("rate_hz", RATE_HZ), crf=10)
    return path
