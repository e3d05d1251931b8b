"""Places in pictures as a lens that does not distort would have shown them."""

from dataclasses import replace

import cv2
import numpy as np

from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.background_path import track_frame
from mtm_audit.tracking.camera_path import moved, moved_track
from mtm_onboard.protocol.errors import MtmError

# OpenCV's own five rounds leave a tenth of a pixel and more near the edges of a wide lens.
_UNTIL = (cv2.TERM_CRITERIA_MAX_ITER | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
# Where the lens does not lead back to the place within this, the calibration says nothing of it.
_MOST_OFF_PX = 0.02


def check_fits(frame: Frame, lens: Lens) -> None:
    """Raise MtmError when the lens was calibrated for pictures of another size."""
    if frame.size != lens.size_px:
        raise MtmError(
            f"{lens.name} is of pictures of {lens.size_px[0]} x {lens.size_px[1]}, and the film's are of "
            f"{frame.size[0]} x {frame.size[1]}; give the calibration of this size, or leave out --camera"
        )


def straightened(points: Floats, lens: Lens) -> Floats:
    """Columns and rows (..., 2) by a lens of the same focal lengths and axis that does not distort.

    NaN where the calibration does not reach: near the corners it may fold.
    """
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 2)
    known = np.isfinite(flat).all(axis=(1, 2))
    straight = np.full_like(flat, np.nan)
    if known.any():
        slopes, back = _through(flat[known], lens)
        off_px = np.linalg.norm(back - flat[known], axis=2, keepdims=True)
        there = slopes * lens.focal_px + np.array(lens.centre_px)
        straight[known] = np.where(off_px < _MOST_OFF_PX, there, np.nan)
    return straight.reshape(np.shape(points))


def straightened_track(track: Track, lens: Lens, *, flipped: bool) -> Track:
    """The track as that lens would have shown it, headings and size too; it is of mirrored pictures when `flipped`."""
    to_tracks = track_frame(lens.size_px, flipped)
    from_tracks = np.linalg.inv(to_tracks)

    def move(places: Floats) -> Floats:
        return moved(to_tracks, straightened(moved(from_tracks, places), lens))

    straight = moved_track(track, move)
    if track.extent_px is None or not straight.valid.any():
        return straight
    # What a lens draws small near the edge is larger now, along the radius most.
    steps = [move(track.positions + step) - straight.positions for step in np.eye(2)]
    return replace(straight, extent_px=track.extent_px * float(np.nanmax(np.linalg.norm(steps, axis=2))))


def straightened_background(seen: BackgroundFollower, lens: Lens) -> BackgroundFollower:
    """What was seen of the background, its points where that lens would have shown them; others are left out."""
    places = [straightened(key.points, lens) for key in seen.keys]
    reached = [np.isfinite(points[:, 0]) for points in places]
    keys = [replace(key, points=points[within]) for key, points, within in zip(seen.keys, places, reached, strict=True)]
    looks = [
        replace(look, places=straightened(look.places[reached[look.key]], lens).astype(np.float32))
        for look in seen.looks
    ]
    return replace(seen, keys=keys, looks=looks)


def _through(places: Floats, lens: Lens) -> tuple[Floats, Floats]:
    """Slopes (n, 1, 2) of the rays behind places (n, 1, 2), and where the lens shows those rays."""
    (across, down), (column, row) = lens.focal_px, lens.centre_px
    matrix = np.array([[across, 0.0, column], [0.0, down, row], [0.0, 0.0, 1.0]])
    distortion = np.array(lens.distortion)
    if lens.model == "fisheye":
        slopes = np.asarray(cv2.fisheye.undistortPoints(places, matrix, distortion, criteria=_UNTIL), np.float64)
        return slopes, np.asarray(cv2.fisheye.distortPoints(slopes, matrix, distortion), np.float64)
    # With criteria the function of OpenCV 4 has a name of its own.
    iterated = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
    slopes = np.asarray(iterated(places, matrix, distortion, R=None, P=None, criteria=_UNTIL), np.float64)
    ahead = np.concatenate([slopes, np.ones_like(slopes[..., :1])], axis=2)
    back, _ = cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), matrix, distortion)
    return slopes, np.asarray(back, np.float64)
