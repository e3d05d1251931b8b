"""Tracking ArUco markers: where each marker is, to a small fraction of a pixel, and where it points."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_onboard.protocol.errors import MtmError

FULL_SEARCH_EVERY = 15  # frames after which the whole picture is searched for markers that are new
SEEN_AT_LEAST = 3  # frames; what is read less often is a chance reading of something else

Found = dict[int, Floats]


@dataclass(frozen=True)
class _Followed:
    """A marker's corners (4, 2) in the last frame, and how far they had moved since the frame before it."""

    corners: Floats
    step: Floats


class ArucoTracker:
    """Follows markers of OpenCV's 4x4 dictionary of 50, searching around where each is expected.

    A marker in a mirrored picture cannot be read until the picture is flipped back. With `mirrored` None both ways
    are tried on every frame until one reads markers; tracks are in pixels of the picture that can be read.
    """

    pixels: Literal["gray", "bgr"] = "gray"

    def __init__(self, mirrored: bool | None = None) -> None:
        self._mirrored = mirrored
        self._thorough = _detector()
        self._quick = _detector(threshold_window_px=15)

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track every marker in gray `frames`: one track per marker, `marker<id>`, in pixels with y up, with headings.

        Raises MtmError when no marker is found or the size of the picture changes.
        """
        gather = Gather()
        followed: dict[int, _Followed] = {}
        known: set[int] = set()
        mirrored = self._mirrored
        for number, frame in enumerate(steady(frames, progress)):
            gather.next_frame(frame)
            if mirrored is None:
                mirrored = self._find_mirroring(frame.image)
            image = np.ascontiguousarray(frame.image[:, ::-1]) if mirrored else frame.image
            found = self._search_near(image, followed)
            if not known or len(found) < len(known) or number % FULL_SEARCH_EVERY == 0:
                found = self._search(image) | found
                known |= found.keys()
            for marker, corners in found.items():
                gather.put(f"marker{marker}", *_pose(corners))
            followed = {marker: _follow(followed.get(marker), corners) for marker, corners in found.items()}
        tracks = [track for track in gather.tracks(with_headings=True) if track.valid.sum() >= SEEN_AT_LEAST]
        if not tracks:
            raise MtmError(
                f"no marker found in {len(gather.times_s)} frames; film markers of OpenCV's 4x4 dictionary of 50 with "
                "a white margin, at least 20 pixels wide, or choose another tracker"
            )
        return tracks

    def _find_mirroring(self, image: Image) -> bool | None:
        """Whether the flipped picture reads more markers; None when neither reads any."""
        plain, flipped = len(self._search(image)), len(self._search(np.ascontiguousarray(image[:, ::-1])))
        return flipped > plain if plain or flipped else None

    def _search(self, image: Image, quick: bool = False) -> Found:
        """Corners (4, 2) of every marker in the picture, by number; a marker seen twice counts where it is largest."""
        quads, numbers, _ = (self._quick if quick else self._thorough).detectMarkers(image)
        corners = [np.asarray(quad, dtype=np.float64).reshape(4, 2) for quad in quads]
        order = sorted(range(len(corners)), key=lambda index: float(np.ptp(corners[index], axis=0).sum()))
        return {int(np.ravel(numbers[index])[0]): corners[index] for index in order}

    def _search_near(self, image: Image, followed: dict[int, _Followed]) -> Found:
        """The followed markers that are where they are expected, at constant velocity, within half their width."""
        found: Found = {}
        for marker, last in followed.items():
            expected = last.corners + last.step
            low, high = expected.min(axis=0), expected.max(axis=0)
            margin = 0.5 * (high - low).max() + 6
            left, upper = np.maximum(low - margin, 0).astype(int)
            right, lower = np.maximum(high + margin, 0).astype(int)
            window = image[upper:lower, left:right]
            if min(window.shape) > 16:
                window = np.ascontiguousarray(window)
                near = self._search(window, quick=True)
                near = near if marker in near else self._search(window)
                if marker in near:
                    found[marker] = near[marker] + np.array([left, upper])
        return found


def _detector(threshold_window_px: int | None = None) -> cv2.aruco.ArucoDetector:
    """A detector that binarises the picture over one window size, or over three (slower, and loses fewer markers)."""
    parameters = cv2.aruco.DetectorParameters()
    if threshold_window_px is not None:
        parameters.adaptiveThreshWinSizeMin = parameters.adaptiveThreshWinSizeMax = threshold_window_px
    parameters.minMarkerPerimeterRate = 0.02
    # Lines fitted to the sides measure small markers three times better than corner refinement does.
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), parameters)


def _follow(last: _Followed | None, corners: Floats) -> _Followed:
    return _Followed(corners, corners - last.corners if last else np.zeros((4, 2)))


def _pose(corners: Floats) -> tuple[float, float, float]:
    """Column and row of the middle, where the diagonals cross, and the heading of the marker's upper edge, y up.

    The crossing is the image of the marker's middle under any perspective; the mean of the corners is not.
    """
    one, other = corners[2] - corners[0], corners[3] - corners[1]
    share = np.linalg.det(np.stack([corners[1] - corners[0], other])) / np.linalg.det(np.stack([one, other]))
    column, row = corners[0] + share * one
    along = corners[1] - corners[0] + corners[2] - corners[3]
    return float(column), float(row), float(np.arctan2(-along[1], along[0]))
