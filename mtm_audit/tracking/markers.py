"""Finding markers in one picture: in all of it, or near where they are expected."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats
from mtm_audit.tracking.corners import refined_corners
from mtm_audit.tracking.dictionaries import cells_of, detector_parameters, dictionary_of

QUICK_WINDOW_PX = 15
LEAST_WINDOW_PX = 16
LEAST_BORDER_PX = 2  # from a marker to the edge of what is searched; nearer it may be cut


@dataclass(frozen=True)
class Sighting:
    """A marker's number and its corners (4, 2), columns and rows, clockwise from its own upper left one."""

    number: int
    corners: Floats

    @cached_property
    def centre(self) -> Floats:
        """Column and row of the middle, where the diagonals cross.

        The crossing is the image of the marker's middle under any perspective; the mean of the corners is not.
        """
        one, other = self.corners[2] - self.corners[0], self.corners[3] - self.corners[1]
        start = self.corners[1] - self.corners[0]
        share = (start[0] * other[1] - start[1] * other[0]) / (one[0] * other[1] - one[1] * other[0])
        centre: Floats = self.corners[0] + share * one
        return centre

    @property
    def heading_rad(self) -> float:
        """Where the marker's upper edge points, counter-clockwise from the picture's right."""
        along = self.corners[1] - self.corners[0] + self.corners[2] - self.corners[3]
        return float(np.arctan2(-along[1], along[0]))

    @cached_property
    def side_px(self) -> float:
        """The larger of the marker's width and height in the picture."""
        return float((self.corners.max(axis=0) - self.corners.min(axis=0)).max())

    @property
    def least_side_px(self) -> float:
        """The length of its shortest side."""
        return float(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=0), axis=1).min())


class MarkerFinder:
    """Reads markers of one dictionary."""

    def __init__(self, dictionary: str) -> None:
        self._cells = cells_of(dictionary)
        self._everywhere = cv2.aruco.ArucoDetector(dictionary_of(dictionary), detector_parameters())
        quick = detector_parameters()
        # The picture is binarised over one window size instead of three: faster, and loses some markers.
        quick.adaptiveThreshWinSizeMin = quick.adaptiveThreshWinSizeMax = QUICK_WINDOW_PX
        unrefined = detector_parameters()
        unrefined.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._unrefined = cv2.aruco.ArucoDetector(dictionary_of(dictionary), unrefined)
        self._nearby = [cv2.aruco.ArucoDetector(dictionary_of(dictionary), quick), self._everywhere]

    def everywhere(self, image: Image) -> list[Sighting]:
        """Every marker in the picture, the largest first; of two on the same place the larger.

        What is read of less than one pixel a cell is writing or texture and no marker.
        """
        return self._found(self._everywhere, image)

    def quickly(self, image: Image) -> list[Sighting]:
        """As `everywhere` at less than half of the cost, with the loss of some markers."""
        return self._found(self._nearby[0], image)

    def _found(self, detector: cv2.aruco.ArucoDetector, image: Image) -> list[Sighting]:
        try:
            quads, numbers, _ = detector.detectMarkers(image)
        except cv2.error:  # a contour too short for its corners to be refined by it
            quads, numbers, _ = self._unrefined.detectMarkers(image)
        found = [
            Sighting(int(np.ravel(numbers[index])[0]), np.asarray(quad, dtype=np.float64).reshape(4, 2))
            for index, quad in enumerate(quads)
        ]
        found = [one for one in found if one.least_side_px >= self._cells]
        kept: list[Sighting] = []
        last = np.array(image.shape[::-1]) - 1 - LEAST_BORDER_PX
        for sighting in sorted(found, key=lambda one: -one.side_px):
            whole = bool(np.all((sighting.corners >= LEAST_BORDER_PX) & (sighting.corners <= last)))
            if whole and not any(_is_same(sighting, larger) for larger in kept):
                kept.append(sighting)
        return kept

    def near(self, image: Image, number: int, expected: Floats) -> Sighting | None:
        """The marker that is nearest to the `expected` corners (4, 2), within half its width; None when none is."""
        low, high = expected.min(axis=0), expected.max(axis=0)
        margin = 0.5 * float((high - low).max()) + 6
        left, upper = (int(edge) for edge in np.maximum(low - margin, 0))
        right, lower = (int(edge) for edge in np.maximum(high + margin, 0))
        window = image[upper:lower, left:right]
        if min(window.shape) <= LEAST_WINDOW_PX:
            return None
        window = np.ascontiguousarray(window)
        origin = np.array([left, upper])
        for detector in self._nearby:
            same = [one for one in self._found(detector, window) if one.number == number]
            if same:
                nearest = min(same, key=lambda one: float(np.linalg.norm(one.centre + origin - expected.mean(axis=0))))
                return Sighting(number, nearest.corners + origin)
        return None

    def refined(self, image: Image, sightings: list[Sighting], *, keep: bool = True) -> list[Sighting]:
        """The sightings with corners to a few hundredths of a pixel.

        One whose sides cannot be measured stays as it is, or gets corners of NaN when it is not to `keep`.
        """
        if not sightings:
            return []
        rough = np.stack([sighting.corners for sighting in sightings])
        fine = refined_corners(image, rough, self._cells)
        if keep:
            fine = np.where(np.isfinite(fine).all(axis=(1, 2), keepdims=True), fine, rough)
        return [Sighting(one.number, corners) for one, corners in zip(sightings, fine, strict=True)]


def _is_same(one: Sighting, larger: Sighting) -> bool:
    apart_px = float(np.linalg.norm(one.corners.mean(axis=0) - larger.corners.mean(axis=0)))
    return one.number == larger.number and apart_px < 0.5 * larger.side_px
