"""The corners of markers to a few hundredths of a pixel, at every angle of a marker to the rows of pixels."""

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.picture import Image
from mtm_audit.model.track import Bools, Floats

PROFILES, SAMPLES = 24, 11  # profiles across each side between its corners, and points along each
SIDE_SHARE = np.linspace(0.1, 0.9, PROFILES)  # the corners themselves are rounded by the lens
STEPS = np.linspace(-1.0, 1.0, SAMPLES)
MIDDLES = (STEPS[:-1] + STEPS[1:]) / 2
# A profile reaches half of the dark border on one side and as far into the white margin on the other.
REACH_CELLS = 0.55
LEAST_REACH_PX, MOST_REACH_PX = 1.6, 5.0
SURE_PX = 0.4
BEFORE, AFTER = [3, 0, 1, 2], [1, 2, 3, 0]
LEAST_CONTRAST = 12.0  # in gray levels, of a side against its margin
FARTHEST_PX = 0.5  # of a profile's edge from its side's line; farther off something lies over the side


def refined_corners(image: Image, corners: Floats, cells: int) -> Floats:
    """Corners (n, 4, 2) where lines through the edges of the sides meet; NaN for a marker whose sides show none.

    `corners` (n, 4, 2), columns and rows, are right to a pixel or two and go clockwise in the picture; `cells` is how
    many cells a side has, the border's two among them. Each profile across a side puts the edge where its gradient has
    its centroid, which is as good between pixels as on them; contours of whole pixels are not.
    """
    sides_px = np.sqrt(np.sum((corners - corners[:, BEFORE]) ** 2, axis=2)).min(axis=1)
    reach_px = np.clip(REACH_CELLS * sides_px / cells, LEAST_REACH_PX, MOST_REACH_PX)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = _once(image, corners, reach_px)
        # An edge far from the middle of its profiles is not measured quite right.
        again = np.abs(found - corners).max(axis=(1, 2)) > SURE_PX
        if again.any():
            found[again] = _once(image, found[again], reach_px[again])
    astray = ~(np.abs(found - corners).max(axis=(1, 2)) < MOST_REACH_PX)
    return np.where(astray[:, None, None], np.nan, found)


def _once(image: Image, corners: Floats, reach_px: Floats) -> Floats:
    sides = corners[:, AFTER] - corners
    along = sides / np.sqrt(np.sum(sides**2, axis=2, keepdims=True))
    outward = np.stack([along[..., 1], -along[..., 0]], axis=2)
    feet = corners[:, :, None] + SIDE_SHARE[:, None] * sides[:, :, None]
    across = (STEPS * reach_px[:, None])[:, None, :, None] * outward[:, :, None]
    gradients = np.maximum(np.diff(_sampled(image, feet[:, :, :, None] + across[:, :, None]), axis=3), 0.0)
    contrasts = gradients.sum(axis=3)
    usual = contrasts.mean(axis=(1, 2))
    good = contrasts > np.maximum(LEAST_CONTRAST, 0.4 * usual)[:, None, None]
    edges_px = reach_px[:, None, None] * (gradients @ MIDDLES) / np.maximum(contrasts, 1e-9)
    lines = _fitted(edges_px, good)
    # Once more without what is off the lines.
    good &= np.abs(edges_px - lines[..., :1] - lines[..., 1:] * SIDE_SHARE) < FARTHEST_PX
    lines = _fitted(edges_px, good)
    return _crossings(corners + lines[..., :1] * outward, sides + lines[..., 1:] * outward)


def _sampled(image: Image, points: Floats) -> NDArray[np.float32]:
    """The picture between its pixels at points (..., 2); NaN around a marker of which one lies outside."""
    rows, columns = image.shape
    x, y = points[..., 0], points[..., 1]
    outside = ~((x >= 0) & (y >= 0) & (x < columns - 1) & (y < rows - 1))
    if outside.any():
        points = np.where(outside[..., None], 0.0, points)
    whole = points.astype(np.intp)
    x, y = np.moveaxis((points - whole).astype(np.float32), -1, 0)
    start = whole[..., 1] * columns + whole[..., 0]
    flat = image.ravel()
    left, right = flat.take(start), flat.take(start + 1)
    below, beside = flat.take(start + columns), flat.take(start + columns + 1)
    upper = left + x * (right.astype(np.float32) - left)
    values = upper + y * (below + x * (beside.astype(np.float32) - below) - upper)
    values[outside.any(axis=tuple(range(1, outside.ndim)))] = np.nan
    return np.asarray(values, dtype=np.float32)


def _fitted(edges_px: Floats, good: Bools) -> Floats:
    """Intercept and slope (n, 4, 2) of each side's edge over its share, by least squares; NaN from too few profiles."""
    count = good.sum(axis=2)
    total = np.where(count < PROFILES // 3, np.nan, count)
    shares = good * SIDE_SHARE
    mean_share = shares.sum(axis=2) / total
    mean_edge = (good * edges_px).sum(axis=2) / total
    spread = (shares * SIDE_SHARE).sum(axis=2) - total * mean_share**2
    slopes = ((shares * edges_px).sum(axis=2) - total * mean_share * mean_edge) / spread
    return np.stack([mean_edge - slopes * mean_share, slopes], axis=2)


def _crossings(starts: Floats, along: Floats) -> Floats:
    """Where each side's line meets that of the side before it, (n, 4, 2)."""
    before, before_along = starts[:, BEFORE], along[:, BEFORE]
    apart = starts - before
    turn = before_along[..., 0] * along[..., 1] - before_along[..., 1] * along[..., 0]
    share = (apart[..., 0] * along[..., 1] - apart[..., 1] * along[..., 0]) / turn
    return before + share[..., None] * before_along
