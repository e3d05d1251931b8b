"""Motion as the robot's own body sees it: turned by the heading."""

import numpy as np

from mtm_audit.model.track import Bools, Floats, Track
from mtm_onboard.protocol import MtmError


def in_body_frame(track: Track) -> Track:
    """Distance ahead, distance to the left and heading of the body, from where it was first seen."""
    kept = track.valid & known_headings(track)
    headings = np.unwrap(track.headings_rad[kept])  # type: ignore[index]
    own = turned(np.diff(track.positions[kept], axis=0), -middles(headings))
    positions = np.concatenate([[[0.0, 0.0]], np.cumsum(own, axis=0)])
    return Track(
        track.name, track.times_s[kept], np.column_stack([positions, headings]), np.ones(len(headings), bool),
        axes=("ahead", "left", "heading"),
    )  # fmt: skip


def known_headings(track: Track) -> Bools:
    """Where the heading is known, (n,); raises MtmError with fewer than three of them."""
    headings = np.full(len(track.times_s), np.nan) if track.headings_rad is None else track.headings_rad
    known: Bools = np.isfinite(headings)
    if np.count_nonzero(known & track.valid) < 3:
        raise MtmError(f"track {track.name!r} has no heading; measure it in the world's frame, with --frame world")
    return known


def turned(vectors: Floats, angles_rad: Floats) -> Floats:
    """Vectors (n, 2), each turned counter-clockwise by its angle (n,)."""
    cosine, sine = np.cos(angles_rad), np.sin(angles_rad)
    x, y = vectors.T
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def middles(values: Floats) -> Floats:
    """The mean of each two neighbours, (n - 1,)."""
    return np.asarray(0.5 * (values[1:] + values[:-1]))
