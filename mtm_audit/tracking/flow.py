"""Tracking an unmarked thing by the flow of its corners (Lucas and Kanade), as the paper's capacity experiment does."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_audit.tracking.kalman import kalman_smoothed
from mtm_audit.tracking.region import Region, checked_region, parse_region
from mtm_onboard.protocol.errors import MtmError

TRACK_NAME = "flow"
MOST_CORNERS = 40
LEAST_CORNERS = 6
RENEWED_BELOW = 0.6  # the share of a sight's first corners under which new ones are sought
RETURN_ERROR_PX = 0.7  # how far from its start a corner may end that is followed there and back
OFF_BODY_PX = 2.0
MARGIN_PX = 40
BODY_EXTENTS = 1.5  # a body may reach beyond the region
BODY_EXTENTS = 1.5  # a body may reach beyond the region
WINDOW_PX, LEVELS = (15, 15), 2
# What was lost is looked for at half resolution, turned by these angles; a correlation of so much is worth a try.
TURNS_RAD = 0.15 * np.arange(-4, 5)
LEAST_LIKENESS = 0.5


@dataclass(frozen=True)
class _Sight:
    """The thing in one picture.

    `corners` (n, 2) are where its corners are, `first_corners` (n, 2) and `first_centre` (2,) where they and its
    middle were when the corners were chosen, `chosen` how many they were; `centre` (2,) is where its middle is now.
    """

    image: Image
    corners: Floats
    first_corners: Floats
    first_centre: Floats
    chosen: int
    centre: Floats


class FlowTracker:
    """Follows what is in a region of the first picture, such as the top of a robot without any mark.

    The corners in there are followed from picture to picture, and the motion most of them agree on (a shift, turn and
    scale) moves the middle of the region. A thing that is lost is looked for around its last place as it last looked.
    The region must show more of the thing than of what is behind it. `smooth` False leaves out the paper's Kalman
    filter.
    """

    pixels: Literal["gray", "bgr"] = "gray"

    def __init__(self, region: Region, *, smooth: bool = True) -> None:
        self._region, self._smooth = region, smooth

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames`, gray or blue, green and red: one track, `flow`, in pixels with y up.

        Raises MtmError when the region leaves the picture or has nothing in it that could be followed, when that is
        lost at once, or when the picture changes its size.
        """
        gather = Gather()
        sight: _Sight | None = None
        lost = 0
        for frame in steady(frames, progress):
            gather.next_frame(frame)
            image = cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY) if frame.image.ndim == 3 else frame.image.copy()
            if sight is None:
                sight = self._first_sight(np.asarray(image), checked_region(self._region, frame.size))
                found: _Sight | None = sight
            else:
                found = self._next_sight(sight, np.asarray(image), lost)
            lost = 0 if found else lost + 1
            if found is not None:
                sight = found
                column, row = float(found.centre[0]), float(found.centre[1])
                gather.put(TRACK_NAME, column, row, extent_px=BODY_EXTENTS * 2.0 * max(self._half(0), self._half(1)))
        if sight is None:
            raise MtmError("the video holds no frame to follow anything in; record it anew")
        if len(gather.seen[TRACK_NAME]) < 2:
            raise MtmError(
                f"what the region {','.join(map(str, self._region))} shows is lost after the first of "
                f"{len(gather.times_s)} frames; choose a region that shows little else than the robot"
            )
        (track,) = gather.tracks(with_headings=False)
        return [kalman_smoothed(track) if self._smooth else track]

    def _first_sight(self, image: Image, region: Region) -> _Sight:
        corners = _corners(image, region)
        if len(corners) < LEAST_CORNERS:
            raise MtmError(
                f"the region {','.join(map(str, region))} of the first frame shows {len(corners)} corners and at least "
                f"{LEAST_CORNERS} are needed; choose one that shows the robot, or put a marker on it"
            )
        centre = np.array([region[0] + region[2] - 1, region[1] + region[3] - 1]) / 2
        return _Sight(image, corners, corners, centre, len(corners), centre)

    def _next_sight(self, last: _Sight, image: Image, lost: int) -> _Sight | None:
        """The thing in the next picture; `lost` is for how many pictures before it has not been seen."""
        found = _followed(last, image) if not lost else None
        if found is None:
            moved = _found_again(last, image, self._box(last.centre, image), MARGIN_PX * min(1 + lost, 4))
            found = None if moved is None else _followed(moved, image)
        if found is None or len(found.corners) >= RENEWED_BELOW * found.chosen:
            return found
        corners = _corners(image, self._box(found.centre, image))
        if len(corners) <= len(found.corners):
            return found
        return _Sight(image, corners, corners, found.centre, len(corners), found.centre)

    def _box(self, centre: Floats, image: Image) -> Region:
        """The region moved to that centre, as much of it as the picture shows."""
        left, upper = np.rint(centre - [self._half(0), self._half(1)]).astype(int)
        right, lower = left + self._region[2] - self._region[0], upper + self._region[3] - self._region[1]
        return max(int(left), 0), max(int(upper), 0), min(int(right), image.shape[1]), min(int(lower), image.shape[0])

    def _half(self, axis: int) -> float:
        return (self._region[axis + 2] - self._region[axis] - 1) / 2


def parse_flow(text: str) -> FlowTracker:
    """The tracker for the region `X0,Y0,X1,Y1`; raises MtmError when that is none."""
    return FlowTracker(parse_region(text))


def _corners(image: Image, region: Region) -> Floats:
    """Good features to track inside the region, (n, 2) columns and rows."""
    left, upper, right, lower = region
    if min(right - left, lower - upper) < 8:
        return np.empty((0, 2))
    # The threshold is against noise: on a region without any contrast every pixel would be as good as the best.
    if float(np.std(image[upper:lower, left:right])) < 2.0:
        return np.empty((0, 2))
    found = cv2.goodFeaturesToTrack(image[upper:lower, left:right], MOST_CORNERS, 0.02, 4)
    if found is None:
        return np.empty((0, 2))
    return np.asarray(found.reshape(-1, 2) + np.array([left, upper]), dtype=np.float64)


def _followed(last: _Sight, image: Image) -> _Sight | None:
    """The sight in the next picture; None when too few corners agree on a motion to there."""
    left, upper = np.maximum(last.corners.min(axis=0) - MARGIN_PX, 0).astype(int)
    right, lower = (np.maximum(last.corners.max(axis=0), 0) + MARGIN_PX).astype(int)
    before, after = last.image[upper:lower, left:right], image[upper:lower, left:right]
    if min(after.shape) < 2 * LEAST_CORNERS:
        return None
    start = (last.corners - [left, upper]).astype(np.float32)
    there, ahead, _ = cv2.calcOpticalFlowPyrLK(before, after, start, start.copy(), winSize=WINDOW_PX, maxLevel=LEVELS)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, start.copy(), winSize=WINDOW_PX, maxLevel=LEVELS)
    inside = np.all((there >= 0) & (there < after.shape[::-1]), axis=1)
    kept = inside & (ahead.ravel() == 1) & (returned.ravel() == 1)
    kept &= np.linalg.norm(back - start, axis=1) < RETURN_ERROR_PX
    if kept.sum() < LEAST_CORNERS:
        return None
    first, now = last.first_corners[kept], there[kept].astype(np.float64) + np.array([left, upper])
    motion, agreeing = cv2.estimateAffinePartial2D(first, now, method=cv2.RANSAC, ransacReprojThreshold=OFF_BODY_PX)
    if motion is None:
        return None
    agree = agreeing.ravel() == 1
    if agree.sum() < max(LEAST_CORNERS, 0.5 * len(last.corners)):
        return None
    centre = motion[:, :2] @ last.first_centre + motion[:, 2]
    return _Sight(image, now[agree], first[agree], last.first_centre, last.chosen, centre)


def _found_again(last: _Sight, image: Image, box: Region, margin_px: int) -> _Sight | None:
    """The last sight turned and shifted to where its picture is most like the new one; None when nowhere."""
    left, upper, right, lower = box
    if min(right - left, lower - upper) < 2 * LEAST_CORNERS:
        return None
    x, y = max(left - margin_px, 0), max(upper - margin_px, 0)
    view = cv2.resize(image[y : lower + margin_px, x : right + margin_px], None, fx=0.5, fy=0.5)
    best, motion = LEAST_LIKENESS, None
    for turn_rad in TURNS_RAD:
        turn = cv2.getRotationMatrix2D(((left + right) / 2, (upper + lower) / 2), np.degrees(turn_rad), 1.0)
        turned = cv2.warpAffine(
            last.image, turn - np.array([[0, 0, left], [0, 0, upper]]), (right - left, lower - upper)
        )
        likeness = cv2.matchTemplate(view, cv2.resize(turned, None, fx=0.5, fy=0.5), cv2.TM_CCOEFF_NORMED)
        _, most, _, place = cv2.minMaxLoc(likeness)
        if most > best:
            best = most
            motion = turn + np.array([[0, 0, x + 2 * place[0] - left], [0, 0, y + 2 * place[1] - upper]])
    if motion is None:
        return None
    moved = np.asarray(cv2.warpAffine(last.image, motion, image.shape[::-1]), dtype=np.uint8)
    return replace(last, image=moved, corners=last.corners @ motion[:, :2].T + motion[:, 2])
