"""The middle line of a straight link in one picture, station by station."""

from dataclasses import dataclass

import cv2
import numpy as np

from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats
from mtm_audit.tracking.cover import COVERED, Cover

STATIONS = 24  # across twice the length that a link first shows
LEAST_AREA_PX = 40
# Left, upper, right and lower edge in pixels.
Box = tuple[int, int, int, int]


@dataclass(frozen=True)
class Link:
    """What is seen of a link: at each station along it the centroid of its cover across, and how wide that is.

    `stations` (STATIONS, 2) columns and rows, NaN where nothing is seen; `widths_px` (STATIONS,); `box` what it fills.
    """

    stations: Floats
    widths_px: Floats
    box: Box


def see_link(image: Image, cover_in: Cover, window: Box, step_px: float | None) -> tuple[Link, float] | None:
    """The link of a colour inside the window, and the distance of its stations (`step_px`, unless that is None).

    None when too little of the colour is there. Patches count together when they are of like size, since something
    that lies across a link parts it.
    """
    left, upper, right, lower = window
    cover = cover_in(image[upper:lower, left:right])
    _, labels, boxes, _ = cv2.connectedComponentsWithStats((cover > COVERED).astype(np.uint8), connectivity=8)
    areas = boxes[1:, cv2.CC_STAT_AREA]
    if not areas.size or areas.max() < LEAST_AREA_PX:
        return None
    members = 1 + np.flatnonzero(areas >= 0.25 * areas.max())
    x0, y0 = boxes[members, cv2.CC_STAT_LEFT].min(), boxes[members, cv2.CC_STAT_TOP].min()
    x1 = (boxes[members, cv2.CC_STAT_LEFT] + boxes[members, cv2.CC_STAT_WIDTH]).max()
    y1 = (boxes[members, cv2.CC_STAT_TOP] + boxes[members, cv2.CC_STAT_HEIGHT]).max()
    x0, y0 = max(int(x0) - 3, 0), max(int(y0) - 3, 0)
    own = np.zeros(len(boxes), dtype=bool)
    own[members] = own[0] = True
    near, weights = labels[y0 : y1 + 3, x0 : x1 + 3], cover[y0 : y1 + 3, x0 : x1 + 3]
    # Full cover is what the link itself shows, whatever light is on it; a tenth of it is noise.
    full = np.median(weights[(near > 0) & own[near]])
    weights = np.clip(weights / full - 0.1, 0.0, 0.9) / 0.9 * own[near]
    rows, columns = np.nonzero(weights)
    weights = weights[rows, columns].astype(np.float64)
    points = np.stack([columns + (left + x0), rows + (upper + y0)], axis=1).astype(np.float64)
    stations, widths_px, step_px = _slices(points, weights, step_px)
    return Link(stations, widths_px, (left + x0, upper + y0, left + int(x1) + 3, upper + int(y1) + 3)), step_px


def _slices(points: Floats, weights: Floats, step_px: float | None) -> tuple[Floats, Floats, float]:
    """Cut the cover across its principal direction; whatever angle a cut has, it halves on the middle line."""
    total = weights.sum()
    offsets = points - weights @ points / total
    spread = (offsets * weights[:, None]).T @ offsets / total
    values, directions = np.linalg.eigh(spread)
    if step_px is None:
        step_px = float(2.0 * np.sqrt(12.0 * values[1]) / STATIONS)
    along = offsets @ directions[:, 1]
    # A pixel is as wide as a cut's edge is sharp: it counts on both sides of it by its share.
    place = along / step_px + STATIONS / 2 - 0.5
    index = np.floor(place).astype(np.int64)
    share = np.clip((place - index - 0.5) * step_px + 0.5, 0.0, 1.0)
    sums = np.zeros((STATIONS + 2, 3))
    for shift, part in ((0, 1.0 - share), (1, share)):
        bins = np.clip(index + shift, -1, STATIONS) + 1
        for column, values_there in enumerate((weights, weights * points[:, 0], weights * points[:, 1])):
            sums[:, column] += np.bincount(bins, part * values_there, STATIONS + 2)
    sums = sums[1:-1]
    seen = sums[:, 0] > 0.5 * step_px
    stations = np.full((STATIONS, 2), np.nan)
    stations[seen] = sums[seen, 1:] / sums[seen, :1]
    return stations, sums[:, 0] / step_px, step_px


def widened(box: Box, margin_px: int, size: tuple[int, int]) -> Box:
    """The box, that much wider on every side as a picture of that size allows."""
    left, upper, right, lower = box
    return (
        max(left - margin_px, 0),
        max(upper - margin_px, 0),
        min(right + margin_px, size[0]),
        min(lower + margin_px, size[1]),
    )
