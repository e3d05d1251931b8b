"""Tracking something bright before a dark background, as the paper does for Lunar Lander."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Track
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_audit.tracking.kalman import kalman_smoothed
from mtm_audit.tracking.region import Region, checked_region, parse_region
from mtm_onboard.protocol.errors import MtmError

THRESHOLD = 60.0
FULL_SEARCH_EVERY = 15
LEAST_AREA_PX = 12
TRACK_NAME = "bright"

Window = Region


def parse_brightness(text: str) -> "BrightnessTracker":
    """The tracker that `[X0,Y0,X1,Y1][,THRESHOLD]` describes; raises MtmError for anything else."""
    parts = [part for part in text.split(",") if part.strip()]
    region, rest = (parse_region(",".join(parts[:4])), parts[4:]) if len(parts) >= 4 else (None, parts)
    try:
        (threshold,) = (float(part) for part in rest) if rest else (THRESHOLD,)
    except ValueError as error:
        raise MtmError(
            f"{text!r} describes no bright thing; write brightness:X0,Y0,X1,Y1 in pixels, and after that if need be "
            "the least brightness, such as brightness:60,0,540,300,60"
        ) from error
    return BrightnessTracker(region, threshold)


class BrightnessTracker:
    """Follows the largest bright patch inside a region of the picture: the centroid of its brightness.

    `region` is left, upper, right and lower edge in pixels, y down (None: the whole picture), `threshold` the least
    brightness (0 to 255) of the patch. A patch that an edge of the region cuts does not count, since the middle of
    the rest is not that of the whole; ground that fills the lower part of the picture never does. The paper's Kalman
    filter is left out with `smooth` False.
    """

    pixels: Literal["gray", "bgr"] = "gray"

    def __init__(self, region: Region | None = None, threshold: float = THRESHOLD, *, smooth: bool = True) -> None:
        if not 0.0 < threshold < 255.0:
            raise MtmError(f"no brightness lies above {threshold:g} only; give a threshold between 0 and 255")
        self._region, self._threshold, self._smooth = region, threshold, smooth

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames`, gray or blue, green and red: one track, `bright`, in pixels with y up.

        Raises MtmError when nothing bright is found, the region leaves the picture, or the picture changes its size.
        """
        gather = Gather()
        window: Window | None = None
        for number, frame in enumerate(steady(frames, progress)):
            gather.next_frame(frame)
            region = checked_region(self._region, frame.size)
            patch = self._patch(frame.image, window, region) if window and number % FULL_SEARCH_EVERY else None
            patch = patch or self._patch(frame.image, region, region)
            window = None
            if patch is not None:
                column, row, window = patch
                gather.put(TRACK_NAME, column, row)
        if not gather.seen:
            raise MtmError(
                f"nothing brighter than {self._threshold:g} found whole inside the region in {len(gather.times_s)} "
                "frames; choose a region around the robot without other bright things, or a lower threshold"
            )
        (track,) = gather.tracks(with_headings=False)
        return [kalman_smoothed(track) if self._smooth else track]

    def _patch(self, image: Image, window: Window, region: Region) -> tuple[float, float, Window] | None:
        """Column, row and surroundings of the largest whole patch inside the window; None when there is none."""
        left, upper, right, lower = window
        view = image[upper:lower, left:right]
        bright = cv2.cvtColor(view, cv2.COLOR_BGR2GRAY) if view.ndim == 3 else view
        _, mask = cv2.threshold(bright, self._threshold, 1, cv2.THRESH_BINARY)
        count, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        x, y, width, height, area = (boxes[1:count, column] for column in range(5))
        whole = (x > 0) & (y > 0) & (x + width < right - left) & (y + height < lower - upper)
        area = np.where(whole, area, 0)
        if not area.size or area.max() < LEAST_AREA_PX:
            return None
        best = int(np.argmax(area))
        x0, y0, w, h = (int(values[best]) for values in (x, y, width, height))
        # Two pixels around the patch take in its soft edge; other patches in there do not count.
        rows, columns = slice(max(y0 - 2, 0), y0 + h + 2), slice(max(x0 - 2, 0), x0 + w + 2)
        near = labels[rows, columns]
        # Counted from half the threshold on, a pixel that comes in begins with no weight.
        weights = np.maximum(bright[rows, columns] - np.float32(0.5 * self._threshold), 0.0)
        weights[(near != 0) & (near != best + 1)] = 0.0
        total = float(weights.sum())
        column = left + columns.start + float(weights.sum(axis=0) @ np.arange(weights.shape[1])) / total
        row = upper + rows.start + float(weights.sum(axis=1) @ np.arange(weights.shape[0])) / total
        around = (left + x0 - w, upper + y0 - h, left + x0 + 2 * w, upper + y0 + 2 * h)
        return column, row, _within(around, region)


def _within(window: Window, region: Region) -> Window:
    return (
        max(window[0], region[0]),
        max(window[1], region[1]),
        min(window[2], region[2]),
        min(window[3], region[3]),
    )
