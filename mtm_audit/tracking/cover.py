"""How much of each pixel a colour covers, by its hue, or whether the pixel lies in a range of HSV."""

import re
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.picture import Image
from mtm_onboard.protocol.errors import MtmError

NAMED_BGR = {
    "red": (0, 0, 255),
    "orange": (0, 128, 255),
    "yellow": (0, 255, 255),
    "green": (0, 255, 0),
    "cyan": (255, 255, 0),
    "blue": (255, 0, 0),
    "magenta": (255, 0, 255),
}
# Two axes of colour without brightness (blue and red against green), so that grays are at the origin.
CHROMA = np.array([[0.5, -0.331, -0.169], [-0.081, -0.419, 0.5]])
LEAST_CHROMA = 20.0
# Largest hue, saturation and value in OpenCV's HSV of eight bits, whose hues are steps of two degrees.
LARGEST_HSV = (180, 255, 255)
COVERED = 0.35  # the least cover of a pixel that belongs to a patch
# What a drifting colour is learnt from: pixels that it covers by so much of the most covered one's share, pixels that
# it covers by less than so much, and at least so many of each.
FULLY_COVERED, HARDLY_COVERED, LEAST_LEARNT_PX = 0.7, 0.25, 12
LEARNT_SHARE = 0.3  # of what is seen each time
MOST_TURNED = 0.6  # the cosine of the angle by which a hue may drift from its name

# From a picture (height, width, 3) in blue, green and red to the cover of its pixels (height, width).
Cover = Callable[[Image], NDArray[np.float32]]


class DriftingCover:
    """The cover of a colour, which follows it while the light or the camera's white balance drifts.

    How the patch and what is around it have changed since the first sighting is added to what the colour's name says.
    A range of HSV stays as it is.
    """

    def __init__(self, colour: str) -> None:
        self._cover = cover_of(colour)
        self._drifts = not colour.lower().startswith("hsv")
        self._named = CHROMA @ parse_colour(colour) if self._drifts else np.zeros(2)
        self._first: NDArray[np.float64] | None = None
        self._drift = np.zeros((2, 2))

    def __call__(self, image: Image) -> NDArray[np.float32]:
        """The cover of a picture's pixels as `cover_of` gives it, by the colour as it last was."""
        return self._cover(image)

    def learn(self, image: Image, cover: NDArray[np.float32]) -> None:
        """See the colour and its surroundings as they are now: a window of the picture and its cover."""
        if not self._drifts:
            return
        most = float(cover.max())
        own, around = cover > FULLY_COVERED * most, cover < HARDLY_COVERED * most
        if min(np.count_nonzero(own), np.count_nonzero(around)) < LEAST_LEARNT_PX:
            return
        now = np.stack([CHROMA @ np.median(image[pixels], axis=0) for pixels in (own, around)])
        if self._first is None:
            self._first = now
        self._drift += LEARNT_SHARE * (now - self._first - self._drift)
        reference, origin = self._named + self._drift[0], self._drift[1]
        towards = reference - origin
        cosine = float(towards @ self._named) / float(np.linalg.norm(towards) * np.linalg.norm(self._named) + 1e-9)
        if cosine > MOST_TURNED and np.linalg.norm(towards) > LEAST_CHROMA:
            self._cover = _hue_cover(towards, origin)


def split_colours(text: str) -> tuple[str, ...]:
    """The colours of a list; a comma inside brackets separates none."""
    return tuple(part.strip() for part in re.split(r",(?![^(]*\))", text))


def cover_of(colour: str) -> Cover:
    """The cover of a colour's name, of `#rrggbb`, or of `hsv(H-H,S-S,V-V)`; raises MtmError for others and for grays.

    The cover of a colour is how far a pixel is from gray towards it, 1 at the colour itself and 0 at other hues, so
    that pixels on an edge count by the part that is covered whatever gray is behind. A range knows 0 and 1 alone.
    """
    if colour.lower().startswith("hsv"):
        return _range_cover(colour)
    return _hue_cover(CHROMA @ parse_colour(colour))


def parse_colour(text: str) -> tuple[int, int, int]:
    """Blue, green, red of a colour's name or of `#rrggbb`; raises MtmError for others and for grays."""
    bgr = NAMED_BGR.get(text.lower())
    if bgr is None:
        try:
            red, green, blue = bytes.fromhex(text.removeprefix("#"))
        except ValueError as error:
            raise MtmError(
                f"{text!r} is no colour; write one of {', '.join(NAMED_BGR)}, six hex digits such as #00ffff, or a "
                "range such as hsv(100-130,80-255,60-255)"
            ) from error
        bgr = (blue, green, red)
    if np.linalg.norm(CHROMA @ bgr) < LEAST_CHROMA:
        raise MtmError(f"{text!r} is too gray to be told from its surroundings; choose a more saturated colour")
    return bgr


def _hue_cover(reference: NDArray[np.float64], origin: NDArray[np.float64] | None = None) -> Cover:
    """The cover of the chroma `reference`, counted from the chroma `origin` of what lies around (gray for None)."""
    scaled = np.stack([reference, [-reference[1], reference[0]]]) / float(reference @ reference)
    offsets = np.zeros(2) if origin is None else scaled @ origin
    axes = np.column_stack([scaled @ CHROMA, -offsets]).astype(np.float32)

    def cover(image: Image) -> NDArray[np.float32]:
        parts = cv2.transform(image.astype(np.float32), axes)
        # Hues within 27 degrees belong to the colour; near gray the hue is noise and says nothing.
        own = np.abs(parts[..., 1]) < np.maximum(0.5 * parts[..., 0], 0.1)
        return np.where(own, np.maximum(parts[..., 0], 0.0), 0.0).astype(np.float32)

    return cover


def _range_cover(text: str) -> Cover:
    bounds = re.fullmatch(r"hsv\((\d+)-(\d+),\s*(\d+)-(\d+),\s*(\d+)-(\d+)\)", text.lower())
    numbers = [int(number) for number in bounds.groups()] if bounds else []
    lows, highs = numbers[::2], numbers[1::2]
    if not bounds or any(high > most for high, most in zip(highs, LARGEST_HSV, strict=True)):
        raise MtmError(
            f"{text!r} is no range of colours; write hsv(H-H,S-S,V-V) with hues of 0 to 180 in steps of two degrees, "
            "saturations and values of 0 to 255, such as hsv(100-130,80-255,60-255)"
        )
    if lows[1] > highs[1] or lows[2] > highs[2]:
        raise MtmError(f"{text!r} is empty; write the smaller saturation and value first")
    low, high = np.array(lows), np.array(highs)

    def cover(image: Image) -> NDArray[np.float32]:
        pixels = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
        if low[0] <= high[0]:
            return (cv2.inRange(pixels, low, high) > 0).astype(np.float32)
        # A range through red, where the hue begins anew.
        below, above = np.array([0, *low[1:]]), np.array([LARGEST_HSV[0], *high[1:]])
        return ((cv2.inRange(pixels, below, high) > 0) | (cv2.inRange(pixels, low, above) > 0)).astype(np.float32)

    return cover
