"""The camera's path from what was seen of the background, the robots masked."""

from collections.abc import Sequence

import cv2
import numpy as np

from mtm_audit.model.track import Bools, Floats, Track
from mtm_audit.tracking.background import GLANCE_S, LEAST_POINTS, BackgroundFollower, homography
from mtm_audit.tracking.camera_path import CameraPath, about_the_middle, bridged, moved

# Of the picture that the points must surround: what all lies in one corner may be a single thing that moves.
LEAST_AREA = 0.1
# A body of unknown size is taken for so much of the picture's width.
USUAL_EXTENT = 0.08
LONGEST_GAP_S = 1.6 * GLANCE_S


def background_path(seen: BackgroundFollower, tracks: Sequence[Track], flipped: bool) -> CameraPath | None:
    """How the camera moved by the background, where it shows; None where the picture shows too little of one.

    `tracks` are in pixels with y up, of mirrored pictures when `flipped`.
    """
    if not seen.looks:
        return None
    to_tracks = track_frame(seen.size, flipped)
    bodies = _Bodies(tracks, to_tracks, seen.size)
    to_first = np.full((len(seen.times_s), 3, 3), np.nan)
    keys = {0: np.eye(3)}
    noises_px, counts = [], []
    on_body = [bodies.cover(key.row, key.points) for key in seen.keys]
    free = [key.points[~covered] for key, covered in zip(seen.keys, on_body, strict=True)]
    if len(free[0]) < LEAST_POINTS or _area(free[0]) < LEAST_AREA * seen.size[0] * seen.size[1]:
        return None
    for look in seen.looks:
        key = seen.keys[look.key]
        good = np.isfinite(look.places[:, 0]) & ~on_body[look.key]
        good &= ~bodies.cover(look.row, look.places)
        motion = homography(key.points[good], look.places[good]) if good.sum() >= LEAST_POINTS else None
        if motion is None:
            continue
        to_first[look.row] = keys.get(look.key, key.to_first) @ np.linalg.inv(motion)
        if look.key + 1 < len(seen.keys) and seen.keys[look.key + 1].row == look.row:
            keys[look.key + 1] = to_first[look.row]
        off_px = moved(motion, key.points[good]) - look.places[good]
        noises_px.append(float(np.median(np.abs(off_px))) / 0.6745)
        counts.append(int(good.sum()))
    if not counts:
        return None
    times_s = np.array(seen.times_s)
    to_first = bridged(to_first / to_first[:, 2:, 2:], times_s, LONGEST_GAP_S)
    to_reference = about_the_middle(to_tracks @ to_first @ np.linalg.inv(to_tracks))
    # Eight numbers are fitted to two coordinates a point.
    noise_px = float(np.median(np.array(noises_px) * np.sqrt(4.0 / np.array(counts))))
    return CameraPath(to_reference, noise_px, f"{int(np.median(counts))} points of the background")


def track_frame(size: tuple[int, int], flipped: bool) -> Floats:
    """From pixels, y down, to the tracks' pixels, y up, of the mirrored picture when `flipped`: (3, 3)."""
    across = [-1.0, 0.0, size[0] - 1.0] if flipped else [1.0, 0.0, 0.0]
    return np.array([across, [0.0, -1.0, size[1] - 1.0], [0.0, 0.0, 1.0]])


class _Bodies:
    """Where the tracked bodies are in each frame."""

    def __init__(self, tracks: Sequence[Track], to_tracks: Floats, size: tuple[int, int]) -> None:
        from_tracks = np.linalg.inv(to_tracks)
        self._places = [moved(from_tracks, track.positions) for track in tracks]
        usual_px = USUAL_EXTENT * size[0]
        self._radii_px = [0.5 * (track.extent_px or usual_px) for track in tracks]

    def cover(self, row: int, points: Floats) -> Bools:
        """Which of the points (n, 2) lie on a body in that frame; none where the frame is not kept, row -1."""
        covered = np.zeros(len(points), dtype=np.bool_)
        if row < 0:
            return covered
        for places, radius_px in zip(self._places, self._radii_px, strict=True):
            if np.isfinite(places[row, 0]):
                covered |= np.sum((points - places[row]) ** 2, axis=1) < radius_px**2
        return covered


def _area(points: Floats) -> float:
    """Of the points' convex hull."""
    return float(cv2.contourArea(cv2.convexHull(points.astype(np.float32))))
