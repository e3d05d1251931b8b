"""The camera's path from things that stand still, such as markers on the floor."""

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.camera_path import CameraPath, about_the_middle, moved
from mtm_onboard.protocol.errors import MtmError

# Two things stand still together when the distance between them is by so much steadier than they are, or than this.
STEADIER, STEADY_PX = 0.25, 0.2
STRIDE_S = 0.1
LEAST_STILL = 3  # two may be on one robot
LEAST_SPREAD = 0.25  # of the picture's diagonal
LEAST_COMMON = 20  # frames
FOR_HOMOGRAPHY = 4
LEAST_WIDTH = 0.1  # of four things' hull, across by along, to be no line
ROUNDS = 2


def chosen_tracks(tracks: Sequence[Track], names: Sequence[str]) -> list[Track]:
    """The named tracks; raises MtmError when one does not exist."""
    by_name = {track.name: track for track in tracks}
    for name in names:
        if name not in by_name:
            raise MtmError(f"there is no track {name!r} to be the reference; the video shows: {', '.join(by_name)}")
    return [by_name[name] for name in names]


def still_tracks(tracks: Sequence[Track], size: tuple[int, int]) -> list[Track]:
    """Tracks that keep their distances while the camera moves, three of them and far apart; otherwise none.

    What each robot does by itself changes its distance from everything else.
    """
    count = len(tracks)
    together = np.zeros((count, count), dtype=np.bool_)
    for one in range(count):
        for other in range(one):
            together[one, other] = together[other, one] = _is_steady(tracks[one], tracks[other])
    group: list[int] = []
    for candidate in np.argsort(-together.sum(axis=1), kind="stable"):
        if all(together[candidate, member] for member in group):
            group.append(int(candidate))
    found = [tracks[index] for index in sorted(group)]
    if len(found) < LEAST_STILL:
        return []
    middles = np.array([np.median(track.positions[track.valid], axis=0) for track in found])
    spread_px = float(np.linalg.norm(np.ptp(middles, axis=0)))
    return found if spread_px >= LEAST_SPREAD * float(np.hypot(*size)) else []


def reference_path(still: Sequence[Track], size: tuple[int, int]) -> CameraPath:
    """How the camera moved by what stands still.

    From four things on the path is a free homography; from fewer it is a camera that turns about itself.
    """
    positions = np.stack([track.positions for track in still])
    turned = np.stack([_pointing(track) for track in still])
    seen = np.stack([track.valid for track in still])
    frames = seen.shape[1]
    best = np.flatnonzero(seen.sum(axis=0) == seen.sum(axis=0).max())
    start = int(best[np.argmin(np.abs(best - frames / 2))])
    places, places_turned = positions[:, start], turned[:, start]
    for _ in range(ROUNDS):  # the second with places that are means over all frames
        paths = np.stack(
            [_fitted(positions[:, row], turned[:, row], places, places_turned, size) for row in range(frames)]
        )
        places, places_turned = (_mean(moved(paths, points)) for points in (positions, turned))
    off_px = moved(paths, positions) - places[:, None]
    noise_px = float(np.sqrt(np.nanmean(off_px**2))) if len(still) > 1 else 0.0
    names = ", ".join(track.name for track in still)
    return CameraPath(about_the_middle(paths), noise_px, f"the track{'s' * (len(still) > 1)} {names}")


def _is_steady(one: Track, other: Track) -> bool:
    both = one.valid & other.valid
    if both.sum() < LEAST_COMMON:
        return False
    stride = max(1, round(STRIDE_S / float(np.median(np.diff(one.times_s)))))
    apart = np.where(both[:, None], one.positions - other.positions, np.nan)
    middle = np.where(both[:, None], one.positions + other.positions, np.nan) / 2
    own_px, common_px = (_jerks(part, stride) for part in (np.linalg.norm(apart, axis=1)[:, None], middle))
    return own_px < max(STEADIER * common_px, STEADY_PX)


def _jerks(signal: Floats, stride: int) -> float:
    """The rms of second differences, which steady drives and slow pans do not make."""
    second = signal[2 * stride :] - 2 * signal[stride:-stride] + signal[: -2 * stride]
    second = second[np.isfinite(second[:, 0])]
    return float(np.sqrt(np.mean(np.sum(second**2, axis=1)))) if len(second) else np.inf


def _pointing(track: Track) -> Floats:
    """A point beside each position in the direction of the heading, (frames, 2); NaN without headings."""
    if track.headings_rad is None or track.extent_px is None:
        return np.full_like(track.positions, np.nan)
    arm = np.stack([np.cos(track.headings_rad), np.sin(track.headings_rad)], axis=1)
    return np.asarray(track.positions + 0.25 * track.extent_px * arm)


def _mean(places: Floats) -> Floats:
    """Over the frames in which a thing was seen; NaN where it never was."""
    known = np.isfinite(places)
    total = np.where(known, places, 0.0).sum(axis=1)
    count = known.sum(axis=1)
    mean: Floats = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
    return mean


def _fitted(now: Floats, now_turned: Floats, places: Floats, places_turned: Floats, size: tuple[int, int]) -> Floats:
    seen = np.isfinite(now[:, 0]) & np.isfinite(places[:, 0])
    if seen.sum() >= FOR_HOMOGRAPHY and _width(places[seen]) > LEAST_WIDTH:
        found, _ = cv2.findHomography(now[seen], places[seen], 0)
        if found is not None:
            return np.asarray(found, dtype=np.float64)
    turned = seen & np.isfinite(now_turned[:, 0]) & np.isfinite(places_turned[:, 0])
    before = np.concatenate([now[seen], now_turned[turned]])
    after = np.concatenate([places[seen], places_turned[turned]])
    return _turn(before, after, size) if seen.any() else np.full((3, 3), np.nan)


def _width(points: Floats) -> float:
    """How wide points lie across, as a share of how far along."""
    values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(values[1] / values[0]) if values[0] > 0 else 0.0


def _turn(before: Floats, after: Floats, size: tuple[int, int]) -> Floats:
    """The homography (3, 3) of a camera that turns about itself.

    Its focal length is taken for the picture's longer side, as most cameras have it: what an error in it does is of
    second order.
    """
    lens = np.array([[max(size), 0.0, (size[0] - 1) / 2], [0.0, max(size), (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    one, other = (_rays(points, lens) for points in (before, after))
    if len(one) == 1:  # no direction is known: the turn without any about the ray
        cross = np.cross(one[0], other[0])
        sine = float(np.linalg.norm(cross))
        rotation = Rotation.from_rotvec(cross / sine * np.arcsin(min(sine, 1.0)) if sine > 0 else np.zeros(3))
    else:
        rotation, _ = Rotation.align_vectors(other, one)
    homography = lens @ rotation.as_matrix() @ np.linalg.inv(lens)
    return np.asarray(homography / homography[2, 2])


def _rays(points: Floats, lens: Floats) -> Floats:
    rays = np.column_stack([points, np.ones(len(points))]) @ np.linalg.inv(lens).T
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))
