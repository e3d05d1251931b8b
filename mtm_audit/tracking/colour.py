"""Tracking coloured things: the centroid of how much of each pixel a colour covers."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Track
from mtm_audit.tracking.cover import COVERED, Cover, DriftingCover, cover_of
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_onboard.protocol.errors import MtmError

FULL_SEARCH_EVERY = 15
LEAST_AREA_PX = 12
COARSE_STEP, MOST_CLOSE_LOOKS = 3, 3
# A colour out of sight is looked for in each of so many frames, then in every fourth; and now and then in all pixels.
EAGER_FRAMES, SELDOM_EVERY = 15, 4
THOROUGH_EVERY = 120
LEARNT_EVERY = 5  # frames; light and white balance drift over seconds
BODY_EXTENTS = 2.5  # a robot's body reaches beyond its patch, and its shadow beyond that

Window = tuple[slice, slice]


class ColourTracker:
    """Follows the largest patch of each of `colours` (names, `#rrggbb` or `hsv(H-H,S-S,V-V)`).

    The background may be any gray: a pixel's weight is how far it is from gray towards the colour, so pixels on an
    edge count by the part that the patch covers. Around the last place is searched first, and every
    `search_every` frames in the whole picture. A patch smaller than `least_share` of what is usual for its colour is
    partly covered, and not valid: its middle is not that of the whole.
    """

    pixels: Literal["gray", "bgr"] = "bgr"

    def __init__(
        self, colours: tuple[str, ...], search_every: int = FULL_SEARCH_EVERY, least_share: float = 0.0
    ) -> None:
        self._search_every, self._least_share = search_every, least_share
        self._colours = colours
        for name in colours:
            cover_of(name)

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames` of blue, green and red: one track per colour, named after it, in pixels with y up.

        Raises MtmError when none of the colours is found or the size of the picture changes.
        """
        following = self.following()
        for frame in steady(frames, progress):
            following.look(frame)
        tracks = following.tracks()
        if not tracks:
            raise MtmError(
                f"none of {', '.join(self._colours)} found in {following.frames} frames; name the colour that the "
                "robot has in the picture, for instance as #rrggbb"
            )
        return tracks

    def following(self) -> "ColourFollowing":
        """What follows the patches from frame to frame."""
        return ColourFollowing(self._colours, self._search_every, self._least_share)


class ColourFollowing:
    """Follows the largest patch of each colour, as `ColourTracker` has it."""

    pixels: Literal["gray", "bgr"] = "bgr"
    flipped = False

    def __init__(self, colours: tuple[str, ...], search_every: int, least_share: float) -> None:
        self.frames = 0
        self._search_every, self._least_share = search_every, least_share
        self._gather = Gather()
        self._windows: dict[str, Window] = {}
        self._covers = {name: DriftingCover(name) for name in colours}
        self._lost = dict.fromkeys(colours, 0)
        # By frame's time, of those that are kept.
        self._areas: dict[str, dict[float, float]] = {name: {} for name in colours}

    def look(self, frame: Frame) -> None:
        """Find the patches of the next frame."""
        number = self.frames
        self.frames += 1
        self._gather.next_frame(frame)
        for name, cover in self._covers.items():
            window = self._windows.pop(name, None)
            patch = _patch(frame.image, cover, window) if window and number % self._search_every else None
            if patch is None and _is_looked_for(self._lost[name]):
                patch = _searched(frame.image, cover, thoroughly=self._lost[name] % THOROUGH_EVERY == 0)
            self._lost[name] = 0 if patch else self._lost[name] + 1
            if patch is not None:
                column, row, area, self._windows[name] = patch
                self._gather.put(name, column, row, extent_px=BODY_EXTENTS * float(np.sqrt(area)))
                self._areas[name][frame.time_s] = area
                if number % LEARNT_EVERY == 0:
                    near = np.ascontiguousarray(frame.image[self._windows[name]][::2, ::2])
                    cover.learn(near, cover(near))

    def tracks(self) -> list[Track]:
        """One track per colour that was found."""
        whole = Gather(self._gather.height_px, self._gather.times_s, {}, self._gather.extents_px)
        for name, sightings in self._gather.seen.items():
            areas = list(self._areas[name].values())
            least = self._least_share * float(np.median(areas))
            whole.seen[name] = {
                row: place for (row, place), area in zip(sightings.items(), areas, strict=True) if area >= least
            }
        return whole.tracks(with_headings=False)

    def latest(self) -> dict[str, tuple[float, float]]:
        """Where the patches are in the last frame."""
        return self._gather.latest()

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self._gather.forget(before_s)
        self._areas = {
            name: {time_s: area for time_s, area in areas.items() if time_s >= before_s}
            for name, areas in self._areas.items()
        }


def _is_looked_for(lost: int) -> bool:
    """Whether a colour that was not seen for so many frames is looked for in the next."""
    return lost < EAGER_FRAMES or lost % SELDOM_EVERY == 0


def _searched(image: Image, cover_in: Cover, *, thoroughly: bool) -> tuple[float, float, float, Window] | None:
    """The largest patch in the whole picture, as `_patch` has it.

    Every third pixel in each direction tells where to look closely; `thoroughly` does so everywhere, for patches that
    fall through.
    """
    if thoroughly:
        return _patch(image, cover_in, (slice(0, None), slice(0, None)))
    coarse = np.ascontiguousarray(image[::COARSE_STEP, ::COARSE_STEP])
    shown = (cover_in(coarse) > COVERED).astype(np.uint8)
    if not shown.any():
        return None
    _, _, boxes, _ = cv2.connectedComponentsWithStats(shown, connectivity=8)
    patches = []
    for index in 1 + np.argsort(-boxes[1:, cv2.CC_STAT_AREA])[:MOST_CLOSE_LOOKS]:
        x, y, width, height = (COARSE_STEP * int(value) for value in boxes[index, : cv2.CC_STAT_AREA])
        margin = 3 * COARSE_STEP
        rows = slice(max(y - margin, 0), y + height + margin)
        columns = slice(max(x - margin, 0), x + width + margin)
        patch = _patch(image, cover_in, (rows, columns))
        if patch is not None:
            patches.append(patch)
    return max(patches, key=lambda patch: patch[2], default=None)


def _patch(image: Image, cover_in: Cover, window: Window) -> tuple[float, float, float, Window] | None:
    """Column, row, area and surroundings of the largest patch of a colour inside the window; None when none is."""
    upper, left = window[0].start, window[1].start
    cover = cover_in(image[window])
    count, labels, boxes, _ = cv2.connectedComponentsWithStats((cover > COVERED).astype(np.uint8), connectivity=8)
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
    return column, row, float(total), (slice(top, upper + y + 2 * height), slice(start, left + x + 2 * width))
