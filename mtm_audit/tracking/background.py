"""Following what stands still behind the robots, to learn how the camera moves.

Patches of a key picture are looked for in each later one, warped as the camera's motion so far has it, so that errors
do not add up from picture to picture, and a turn or a change of scale leaves them alike. Points on robots are told
apart afterwards, when the tracks are known.
"""

from bisect import bisect_left
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats

COLUMNS, ROWS = 12, 9  # of cells, each of which gives its best point
WINDOW_PX, PATCH_PX, LEVELS = 19, 36, 1
# The least eigenvalue, by OpenCV's scale, of a patch that noise of two gray levels moves by less than 0.2 px.
LEAST_EIGENVALUE = 1.7e-5
COARSE_WIDTH_PX = 320
RANSAC_PX = 0.6
LEAST_POINTS = 12
LEAST_SHARE = 0.5  # of a key picture's points; with fewer in sight a new key picture is taken
# A camera that was still for so long is looked at now and then, until it moves by so much.
STILL_S, GLANCE_S, STILL_PX = 0.3, 0.1, 0.15
RETRY_S = 2.0  # after which a background is looked for again where there was none
FEW = 20  # points that tell whether it does


@dataclass(frozen=True)
class Key:
    """A key picture: its gray image, `points` (n, 2) in it, and the homography (3, 3) from it to the first picture.

    `row` is its frame's number, -1 where that is not kept any more.
    """

    row: int
    image: Image
    points: Floats
    to_first: Floats


@dataclass(frozen=True)
class Look:
    """Where the points of key picture number `key` are in the frame `row`: `places` (n, 2), NaN where not found."""

    row: int
    key: int
    places: NDArray[np.float32]


@dataclass
class BackgroundFollower:
    """What was seen of the background in frames that came one by one; only their size when it `is_needed` not."""

    is_needed: bool = True
    keys: list[Key] = field(default_factory=list)
    looks: list[Look] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)
    size: tuple[int, int] = (0, 0)
    _motion: Floats = field(default_factory=lambda: np.eye(3))
    _coarse: Image | None = None
    # Of the last motion, for as long as the camera stays.
    _few: "_Patches | None" = None
    _moved_s: float = -np.inf
    _looked_s: float = -np.inf

    def look(self, frame: Frame) -> None:
        """Find the background's points in the next frame."""
        if self.times_s and frame.size != self.size:
            return  # the tracker refuses such a film
        self.times_s.append(frame.time_s)
        self.size = frame.size
        if not self.is_needed:
            return
        if self.keys and len(self.keys[-1].points) < LEAST_POINTS:
            if len(self.keys) > 1 or frame.time_s - self._looked_s < RETRY_S:
                return
            # So far there was nothing to see, as in a film that begins in the dark.
            self.keys, self.looks = [], []
        is_still = bool(self.keys) and self._looked_s - self._moved_s > STILL_S
        if is_still and frame.time_s - self._looked_s < GLANCE_S:
            return
        if is_still and frame.image.ndim == 2 and self._is_where_it_was(frame.image):
            self._looked_s = frame.time_s
            self.looks.append(replace(self.looks[-1], row=len(self.times_s) - 1))
            return
        self._few = None
        image = frame.image if frame.image.ndim == 2 else cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)
        image = np.asarray(image, dtype=np.uint8)
        coarse = _coarse(image)
        if not self.keys:
            self._take_key(image, np.eye(3), frame.time_s)
        else:
            self._find(image, coarse, frame.time_s)
        self._coarse, self._looked_s = coarse, frame.time_s

    def forget(self, before_s: float) -> None:
        """Drop the frames that are older than `before_s`, and the key pictures that no other frame is compared with.

        A key picture whose own frame is dropped has the row -1.
        """
        count = bisect_left(self.times_s, before_s)
        kept = [look for look in self.looks if look.row >= count]
        first = kept[0].key if kept else max(len(self.keys) - 1, 0)
        self.looks = [replace(look, row=look.row - count, key=look.key - first) for look in kept]
        if self.keys:
            onto_first = np.linalg.inv(self.keys[first].to_first)
            self.keys = [
                replace(key, row=max(key.row - count, -1), to_first=onto_first @ key.to_first)
                for key in self.keys[first:]
            ]
        del self.times_s[:count]

    def until(self, end_s: float) -> "BackgroundFollower":
        """What was seen before `end_s`, without the pictures: enough for the camera's path, and no more can follow."""
        count = bisect_left(self.times_s, end_s)
        looks = [look for look in self.looks if look.row < count]
        keys = [replace(key, image=np.empty((0, 0), np.uint8)) for key in self.keys if key.row < count]
        return BackgroundFollower(self.is_needed, keys, looks, self.times_s[:count], self.size)

    def _is_where_it_was(self, image: Image) -> bool:
        """Whether a few points lie where they were when the camera last moved."""
        if self._few is None:
            key = self.keys[-1]
            self._few = _patches(replace(key, points=key.points[:: len(key.points) // FEW or 1]), image, self._motion)
        places = self._few.found(image)
        off_px = np.linalg.norm(places - self._few.expected, axis=1)
        off_px = off_px[np.isfinite(off_px)]
        return len(off_px) >= FEW // 2 and float(np.median(off_px)) < STILL_PX

    def _take_key(self, image: Image, to_first: Floats, time_s: float) -> None:
        if self.keys:  # nothing is looked for in the picture before any more, and a long pan has many
            self.keys[-1] = replace(self.keys[-1], image=np.empty((0, 0), np.uint8))
        self.keys.append(Key(len(self.times_s) - 1, image.copy(), _good_points(image), to_first))
        self._motion = np.eye(3)
        places = self.keys[-1].points.astype(np.float32)
        self.looks.append(Look(len(self.times_s) - 1, len(self.keys) - 1, places))
        self._moved_s = time_s

    def _find(self, image: Image, coarse: Image, time_s: float) -> None:
        key = self.keys[-1]
        expected = self._coarse_step(coarse) @ self._motion
        places = _patches(key, image, expected).found(image)
        found = np.isfinite(places[:, 0])
        motion = homography(key.points[found], places[found]) if found.sum() >= LEAST_POINTS else None
        if motion is None:
            # Nothing agrees: what is before the camera now is another scene, or a blur; the next frames tell.
            self._motion = expected
            self._moved_s = time_s
            if _share_inside(key.points, expected, self.size) < LEAST_SHARE:
                self._take_key(image, key.to_first @ np.linalg.inv(expected), time_s)
            return
        if _step_px(key.points, self._motion, motion) > STILL_PX:
            self._moved_s = time_s
        self._motion = motion
        self.looks.append(Look(len(self.times_s) - 1, len(self.keys) - 1, places))
        if _share_inside(key.points, motion, self.size) < LEAST_SHARE:
            self._take_key(image, key.to_first @ np.linalg.inv(motion), time_s)

    def _coarse_step(self, coarse: Image) -> Floats:
        """The homography from the last picture looked at to this one, to a pixel or two."""
        assert self._coarse is not None
        scale = self.size[0] / coarse.shape[1]
        points = cv2.perspectiveTransform(self.keys[-1].points[None], self._motion)[0] / scale
        inside = np.all((points > 4) & (points < np.array(coarse.shape[::-1]) - 5), axis=1)
        start = points[inside].astype(np.float32)
        if len(start) < LEAST_POINTS:
            return np.eye(3)
        after, status, _ = cv2.calcOpticalFlowPyrLK(
            self._coarse, coarse, start, start.copy(), winSize=(15, 15), maxLevel=3
        )
        good = status.ravel() == 1
        if good.sum() < LEAST_POINTS:
            return np.eye(3)
        step, _ = cv2.estimateAffinePartial2D(start[good], after[good], ransacReprojThreshold=1.0)
        if step is None:
            return np.eye(3)
        step[:, 2] *= scale
        return np.vstack([step, [0.0, 0.0, 1.0]])


def homography(points: Floats, places: Floats) -> Floats | None:
    """The homography (3, 3) from `points` (n, 2) to `places` that half of them agree on, to three times their noise."""
    fitted, agreeing = cv2.findHomography(points, places, cv2.RANSAC, RANSAC_PX)
    if fitted is None:
        return None
    agree = agreeing.ravel() == 1
    off_px = np.linalg.norm(cv2.perspectiveTransform(points[None], fitted)[0] - places, axis=1)
    noise_px = float(np.median(off_px[agree])) / 0.83 if agree.any() else np.inf
    near = off_px < min(max(3.0 * noise_px, 0.05), RANSAC_PX)
    if near.sum() < max(LEAST_POINTS, 0.4 * len(points)):
        return None
    refitted, _ = cv2.findHomography(points[near], places[near], 0)
    return None if refitted is None else np.asarray(refitted, dtype=np.float64)


def _coarse(image: Image) -> Image:
    height = max(round(image.shape[0] * COARSE_WIDTH_PX / image.shape[1]), 16)
    size = (min(COARSE_WIDTH_PX, image.shape[1]), height if image.shape[1] > COARSE_WIDTH_PX else image.shape[0])
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _good_points(image: Image) -> Floats:
    """The best point (n, 2) of every cell that has any, away from the picture's border."""
    strength = cv2.cornerMinEigenVal(image, WINDOW_PX, ksize=3)
    margin = PATCH_PX // 2 + 2
    height, width = image.shape
    points = []
    for rows in np.array_split(np.arange(margin, height - margin), ROWS):
        for columns in np.array_split(np.arange(margin, width - margin), COLUMNS):
            if not (len(rows) and len(columns)):
                continue
            _, best, _, place = cv2.minMaxLoc(strength[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
            if best >= LEAST_EIGENVALUE:
                points.append((columns[0] + place[0], rows[0] + place[1]))
    return np.array(points, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class _Patches:
    """What a key's points look like at `expected` (n, 2), where a motion of the camera puts them.

    All patches lie below one another in the picture `before`, so that one call finds them all; of those that are
    `inside` the picture (their numbers), `corners` are where they begin in it.
    """

    expected: NDArray[np.float64]
    inside: NDArray[np.intp]
    corners: NDArray[np.int32]
    before: Image

    def found(self, image: Image) -> NDArray[np.float32]:
        """Where the points are in a picture, (n, 2); NaN where not found near to where they are expected."""
        places = np.full(self.expected.shape, np.nan, np.float32)
        if not len(self.inside):
            return places
        left, upper = self.corners.T
        now = np.lib.stride_tricks.sliding_window_view(image, (PATCH_PX, PATCH_PX))[upper, left].reshape(-1, PATCH_PX)
        shifts = np.stack([-left, PATCH_PX * np.arange(len(self.inside)) - upper], axis=1)
        start = (self.expected[self.inside] + shifts).astype(np.float32)
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            self.before, now, start, start.copy(), winSize=(WINDOW_PX, WINDOW_PX), maxLevel=LEVELS
        )
        good = (status.ravel() == 1) & (np.abs(found - start).max(axis=1) < PATCH_PX / 4)
        places[self.inside[good]] = (found - shifts)[good]
        return places


def _patches(key: Key, image: Image, motion: Floats) -> _Patches:
    """The patches around the key's points as `motion` (3, 3) turns and scales them in pictures of that size."""
    expected = cv2.perspectiveTransform(key.points[None], motion)[0]
    corners = np.rint(expected).astype(np.int32) - PATCH_PX // 2
    inside = np.flatnonzero(np.all((corners >= 0) & (corners + PATCH_PX <= np.array(image.shape[::-1])), axis=1))
    corners = corners[inside]
    if not len(inside):
        return _Patches(expected, inside, corners, np.empty((0, PATCH_PX), np.uint8))
    grid = np.stack(np.meshgrid(np.arange(PATCH_PX), np.arange(PATCH_PX)), axis=-1)
    own = (corners[:, None, None] + grid).astype(np.float32).reshape(-1, PATCH_PX, 2)
    maps = cv2.perspectiveTransform(own, np.linalg.inv(motion))
    before = cv2.remap(key.image, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return _Patches(expected, inside, corners, np.asarray(before, dtype=np.uint8))


def _share_inside(points: Floats, motion: Floats, size: tuple[int, int]) -> float:
    places = cv2.perspectiveTransform(points[None], motion)[0]
    margin = PATCH_PX / 2
    return float(np.mean(np.all((places > margin) & (places < np.array(size) - margin), axis=1)))


def _step_px(points: Floats, before: Floats, after: Floats) -> float:
    """The rms distance that points of the key picture go between two motions."""
    steps = cv2.perspectiveTransform(points[None], after) - cv2.perspectiveTransform(points[None], before)
    return float(np.sqrt(np.mean(np.sum(steps**2, axis=2))))
