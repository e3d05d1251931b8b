"""How the camera moved: what brings each picture onto one of them, and tracks as that one would show them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.model.track import Floats, Track

# Less than this, and than so many times its own uncertainty, is no motion worth taking out.
LEAST_PX, TIMES_NOISE = 0.05, 4.0


@dataclass(frozen=True)
class CameraPath:
    """`to_reference` (frames, 3, 3): homographies in the frame of the tracks, pixels with y up, NaN where unknown.

    `noise_px` is how uncertain a place is in each direction after them; `source` says in words what they come from.
    """

    to_reference: Floats
    noise_px: float
    source: str

    @property
    def known(self) -> float:
        """The share of the frames of which the motion is known."""
        return float(np.mean(np.isfinite(self.to_reference[:, 0, 0])))

    def unknown_s(self, times_s: Floats) -> tuple[tuple[float, float], ...]:
        """First and last time of each stretch of frames, at `times_s`, of which the motion is unknown."""
        unknown = np.concatenate([[False], ~np.isfinite(self.to_reference[:, 0, 0]), [False]])
        edges = np.flatnonzero(np.diff(unknown.astype(np.int8)))
        return tuple((float(times_s[first]), float(times_s[after - 1])) for first, after in edges.reshape(-1, 2))

    def motion_px(self, tracks: Sequence[Track]) -> float:
        """The rms shift of the pictures where the tracks are, in each direction, about its mean."""
        middles = np.array([np.median(track.positions[track.valid], axis=0) for track in tracks if track.valid.any()])
        shifts = moved(self.to_reference[:, None], middles[None]) - middles
        known = shifts[np.isfinite(shifts[:, 0, 0])]
        return float(np.sqrt(np.mean(np.var(known, axis=0)))) if len(known) else 0.0

    def is_still(self, tracks: Sequence[Track]) -> bool:
        """Whether the camera moved by no more than could be told."""
        return self.motion_px(tracks) < max(LEAST_PX, TIMES_NOISE * self.noise_px)

    def applied(self, track: Track) -> Track:
        """The track as a camera that stood still would have shown it, headings too; not valid where that is unknown."""
        return moved_track(track, self._moved)

    def _moved(self, places: Floats) -> Floats:
        """Places (frames, ..., 2), each under the homography of its frame."""
        between = (1,) * (places.ndim - 2)
        return moved(self.to_reference.reshape(-1, *between, 3, 3), places)


def moved_track(track: Track, move: Callable[[Floats], Floats]) -> Track:
    """The track with `move` applied to its places (n, ..., 2), headings too; not valid where that gives NaN."""
    positions = move(track.positions)
    valid = track.valid & np.isfinite(positions[:, 0])
    positions = np.where(valid[:, None], positions, np.nan)
    headings = track.headings_rad
    if headings is not None:
        # A small step along the heading, carried over with the position, points where the heading does afterwards.
        steps = move(track.positions + np.stack([np.cos(headings), np.sin(headings)], axis=1)) - positions
        headings = np.arctan2(steps[:, 1], steps[:, 0])
    corners = None if track.corners is None else move(track.corners)
    return replace(track, positions=positions, valid=valid, headings_rad=headings, corners=corners)


def moved(homographies: Floats, points: Floats) -> Floats:
    """Points (..., 2) under homographies (..., 3, 3)."""
    with np.errstate(invalid="ignore"):
        lifted = np.einsum("...jk,...k->...j", homographies[..., :2], points) + homographies[..., 2]
        places: Floats = lifted[..., :2] / lifted[..., 2:]
    return places


def about_the_middle(to_first: Floats) -> Floats:
    """Homographies (n, 3, 3) to one picture as those to the known one nearest to the middle of the recording.

    Far from the reference, perspective stretches what a panning camera shows; in the middle it does so least.
    """
    known = np.flatnonzero(np.isfinite(to_first[:, 0, 0]))
    if not len(known):
        return to_first
    middle = known[np.argmin(np.abs(known - len(to_first) / 2))]
    centred = np.linalg.inv(to_first[middle]) @ to_first
    scaled: Floats = centred / centred[:, 2:, 2:]
    return scaled


def bridged(homographies: Floats, times_s: Floats, longest_s: float) -> Floats:
    """Unknown homographies (NaN) between known ones at most `longest_s` apart, interpolated."""
    known = np.flatnonzero(np.isfinite(homographies[:, 0, 0]))
    if not len(known):
        return homographies
    flat = homographies.reshape(-1, 9)
    filled = np.stack([np.interp(times_s, times_s[known], column[known]) for column in flat.T], axis=1)
    after = np.clip(np.searchsorted(known, np.arange(len(times_s))), 0, len(known) - 1)
    before = np.clip(after - 1, 0, None)
    gap_s = times_s[known[after]] - times_s[known[before]]
    inside = (times_s >= times_s[known[0]]) & (times_s <= times_s[known[-1]])
    usable = np.isfinite(flat[:, 0]) | (inside & (gap_s <= longest_s))
    usable |= (times_s > times_s[known[-1]]) & (times_s - times_s[known[-1]] <= longest_s)
    return np.where(usable[:, None], filled, np.nan).reshape(-1, 3, 3)
