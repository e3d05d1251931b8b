"""From the middle lines of an arm's links to the angles of its joints."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Bools, Floats, Track
from mtm_audit.tracking.kalman import kalman_smoothed

# A station counts when its width is within this of the link's: elsewhere something lies over a side of the link, or
# the link ends, and the middle of what shows is not the link's.
WIDTH_TOLERANCE = 0.08
FARTHEST_OFF_LINE_PX = 0.7
LEAST_STATIONS = 3
# The base is where the lines of a turning link meet; a link that hardly turns leaves it to where the link ends.
END_WEIGHT = 1e-3


@dataclass(frozen=True)
class Stations:
    """A link in all frames: `points` (frames, stations, 2) in pixels, y up, and `widths_px` (frames, stations)."""

    points: Floats
    widths_px: Floats


@dataclass(frozen=True)
class _Lines:
    """A line for each frame, through `middles` (n, 2) along `directions` (n, 2); `good` (n, stations) are on it."""

    middles: Floats
    directions: Floats
    good: Bools

    @property
    def valid(self) -> Bools:
        return np.asarray(self.good.sum(axis=1) >= LEAST_STATIONS)


def joint_angles(
    times_s: Floats, inner: Stations, outer: Stations, base: Floats | None = None, *, smooth: bool = True
) -> Floats:
    """The inner link's direction and the outer link's from it, (frames, 2) in rad, NaN where too little is seen.

    Both links pass through their joint, so a link's direction is that of the centroid of its stations from the joint,
    each station weighted by its distance: the least-squares line through the joint. Integrated over time, the paper's
    omega = (r x v_rel) / |r|^2 of centroids is the same angle.
    """
    inner_lines, outer_lines = _lines(inner), _lines(outer)
    valid = inner_lines.valid & outer_lines.valid
    angles = np.full((len(times_s), 2), np.nan)
    if not valid.any():
        return angles
    if base is None:
        base = _base(inner_lines, outer_lines.middles, inner, valid)
    inner_along = _along(inner.points, inner_lines.good, base)
    length_px = _inner_length_px(inner_along, base, inner, outer_lines, valid)
    elbows = base + length_px * inner_along
    outer_along = _along(outer.points, outer_lines.good, elbows[:, None])
    if smooth:
        reach_px = float(np.median(np.linalg.norm((outer_lines.middles - elbows)[valid], axis=1)))
        places = np.concatenate([base + length_px / 2 * inner_along, elbows + reach_px * outer_along], axis=1)
        places = np.where(valid[:, None], places, np.nan)
        places = kalman_smoothed(Track("links", times_s, places, valid, ("x", "y", "x", "y"), "px")).positions
        inner_along = (places[:, :2] - base) / (length_px / 2)
        outer_along = places[:, 2:] - base - length_px * inner_along
    absolute = np.arctan2(
        [inner_along[valid, 1], outer_along[valid, 1]], [inner_along[valid, 0], outer_along[valid, 0]]
    )
    angles[valid, 0] = np.unwrap(absolute[0])
    angles[valid, 1] = np.unwrap(np.angle(np.exp(1j * (absolute[1] - absolute[0]))))
    return angles


def _lines(link: Stations) -> _Lines:
    """The line through the stations of full width, those off it by more than others of a straight link left out."""
    widths = link.widths_px
    usual = np.median(widths[widths > 0.6 * widths.max()]) if widths.max() > 0 else 0.0
    good = np.isfinite(link.points[..., 0]) & (np.abs(widths - usual) <= WIDTH_TOLERANCE * usual)
    lines = _fit(link.points, good)
    normals = np.stack([-lines.directions[:, 1], lines.directions[:, 0]], axis=1)
    off_px = np.abs(np.einsum("fsk,fk->fs", link.points - lines.middles[:, None], normals))
    return _fit(link.points, good & (off_px < FARTHEST_OFF_LINE_PX))


def _fit(points: Floats, good: Bools) -> _Lines:
    weights = good / np.maximum(good.sum(axis=1), 1)[:, None]
    known = np.where(good[..., None], points, 0.0)
    middles = np.einsum("fs,fsk->fk", weights, known)
    offsets = np.where(good[..., None], known - middles[:, None], 0.0)
    spread = np.einsum("fs,fsj,fsk->fjk", weights, offsets, offsets)
    angles = 0.5 * np.arctan2(2 * spread[:, 0, 1], spread[:, 0, 0] - spread[:, 1, 1])
    return _Lines(middles, np.stack([np.cos(angles), np.sin(angles)], axis=1), good)


def _along(points: Floats, good: Bools, joint: Floats) -> Floats:
    """Unit vectors (frames, 2) from the joint along the link; NaN where no station is good."""
    arms = np.where(good[..., None], points - joint, 0.0)
    sums = np.einsum("fs,fsk->fk", np.linalg.norm(arms, axis=2), arms)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    units: Floats = np.divide(sums, lengths, out=np.full_like(sums, np.nan), where=lengths > 0)
    return units


def _base(lines: _Lines, outer_middles: Floats, inner: Stations, valid: Bools) -> Floats:
    """Where the inner link's lines meet, in the least-squares sense; its end away from the outer link starts that."""
    signs = np.sign(np.einsum("fk,fk->f", outer_middles - lines.middles, lines.directions))
    outwards = lines.directions * np.where(signs == 0, 1.0, -signs)[:, None]
    reach = np.einsum(
        "fsk,fk->fs", np.where(lines.good[..., None], inner.points - lines.middles[:, None], 0.0), outwards
    )
    ends = (lines.middles + reach.max(axis=1)[:, None] * outwards)[valid]
    normals = np.stack([-lines.directions[valid, 1], lines.directions[valid, 0]], axis=1)
    offsets = np.einsum("fk,fk->f", normals, lines.middles[valid])
    kept = np.ones(len(normals), dtype=bool)
    base: Floats = np.median(ends, axis=0)
    for _ in range(3):  # lines that something bent aside are left out of the second and third round
        square = np.einsum("fj,fk->jk", normals[kept], normals[kept]) + END_WEIGHT * kept.sum() * np.eye(2)
        right = normals[kept].T @ offsets[kept] + END_WEIGHT * kept.sum() * np.median(ends, axis=0)
        base = np.linalg.solve(square, right)
        misses_px = np.abs(normals @ base - offsets)
        kept = misses_px <= np.maximum(3.0 * np.median(misses_px), FARTHEST_OFF_LINE_PX)
    return base


def _inner_length_px(along: Floats, base: Floats, inner: Stations, outer: _Lines, valid: Bools) -> float:
    """How far from the base the outer link's line crosses the inner one: the elbow.

    An arm that is never bent shows no crossing; the end of the inner link then stands for it, and makes no difference.
    """
    bends = along[:, 0] * outer.directions[:, 1] - along[:, 1] * outer.directions[:, 0]
    apart = outer.middles - base
    crossings = apart[:, 0] * outer.directions[:, 1] - apart[:, 1] * outer.directions[:, 0]
    bent = valid & (np.abs(bends) > 0.3)
    if not bent.any():
        reach = np.einsum("fsk,fk->fs", np.nan_to_num(inner.points - base), np.nan_to_num(along))
        return float(np.median(reach[valid].max(axis=1)))
    return float(np.median(crossings[bent] / bends[bent]))
