"""Tracking coloured things: the centroid of how much of each pixel a colour covers."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from mtm_audit.recordings.frames import Frame, Image
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_audit.tracks import Track
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
FULL_SEARCH_EVERY = 15
LEAST_AREA_PX = 12

Window = tuple[slice, slice]


def parse_colour(text: str) -> tuple[int, int, int]:
    """Blue, green, red of a colour's name or of `#rrggbb`; raises MtmError for others and for grays."""
    bgr = NAMED_BGR.get(text.lower())
    if bgr is None:
        try:
            red, green, blue = bytes.fromhex(text.removeprefix("#"))
        except ValueError as error:
            raise MtmError(
                f"{text!r} is no colour; write one of {', '.join(NAMED_BGR)} or six hex digits such as #00ffff"
            ) from error
        bgr = (blue, green, red)
    if np.linalg.norm(CHROMA @ bgr) < LEAST_CHROMA:
        raise MtmError(f"{text!r} is too gray to be told from its surroundings; choose a more saturated colour")
    return bgr


class ColourTracker:
    """Follows the largest patch of each of `colours` (names or `#rrggbb`).

    The background may be any gray: a pixel's weight is how far it is from gray towards the colour, so pixels on an
    edge count by the part that the patch covers.
    """

    pixels: Literal["gray", "bgr"] = "bgr"

    def __init__(self, colours: tuple[str, ...]) -> None:
        self._chroma = {name: CHROMA @ parse_colour(name) for name in colours}

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames` of blue, green and red: one track per colour, named after it, in pixels with y up.

        Raises MtmError when none of the colours is found or the size of the picture changes.
        """
        gather = Gather()
        windows: dict[str, Window] = {}
        for number, frame in enumerate(steady(frames, progress)):
            gather.next_frame(frame)
            for name, chroma in self._chroma.items():
                window = windows.pop(name, None)
                patch = _patch(frame.image, chroma, window) if window and number % FULL_SEARCH_EVERY else None
                patch = patch or _patch(frame.image, chroma, (slice(0, None), slice(0, None)))
                if patch is not None:
                    column, row, windows[name] = patch
                    gather.put(name, column, row)
        if not gather.seen:
            raise MtmError(
                f"none of {', '.join(self._chroma)} found in {len(gather.times_s)} frames; name the colour that the "
                "robot has in the picture, for instance as #rrggbb"
            )
        return gather.tracks(with_headings=False)


def _patch(image: Image, reference: NDArray[np.float64], window: Window) -> tuple[float, float, Window] | None:
    """Column, row and surroundings of the largest patch of a colour inside the window; None when there is none."""
    upper, left = window[0].start, window[1].start
    cover = _cover(image[window], reference)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats((cover > 0.35).astype(np.uint8), connectivity=8)
    if count < 2:
        return None
    largest = 1 + int(np.argmax(boxes[1:, cv2.CC_STAT_AREA]))
    x, y, width, height, area = (int(value) for value in boxes[largest])
    if area < LEAST_AREA_PX:
        return None
    # Four pixels around the patch take in its soft edge; other patches in there do not count.
    rows, columns = slice(max(y - 4, 0), y + height + 4), slice(max(x - 4, 0), x + width + 4)
    weights, near = cover[rows, columns], labels[rows, columns]
    weights = np.where((near == 0) | (near == largest), weights, 0.0)
    # Full cover is what the patch itself shows, whatever light is on it; a tenth of it is noise.
    weights = np.clip(weights / np.median(weights[near == largest]) - 0.1, 0.0, 0.9)
    total = weights.sum()
    column = left + columns.start + float(weights.sum(axis=0) @ np.arange(weights.shape[1]) / total)
    row = upper + rows.start + float(weights.sum(axis=1) @ np.arange(weights.shape[0]) / total)
    top, start = max(upper + y - height, 0), max(left + x - width, 0)
    return column, row, (slice(top, upper + y + 2 * height), slice(start, left + x + 2 * width))


def _cover(image: Image, reference: NDArray[np.float64]) -> NDArray[np.float32]:
    """How far each pixel is from gray towards the colour, 1 at the colour itself; 0 for other hues."""
    length = float(np.linalg.norm(reference))
    towards, across = reference / length**2 @ CHROMA, np.array([-reference[1], reference[0]]) / length**2 @ CHROMA
    parts = cv2.transform(image.astype(np.float32), np.stack([towards, across]))
    # Hues within 27 degrees belong to the colour; near gray the hue is noise and says nothing.
    own = np.abs(parts[..., 1]) < np.maximum(0.5 * parts[..., 0], 0.1)
    return np.where(own, np.maximum(parts[..., 0], 0.0), 0.0).astype(np.float32)
