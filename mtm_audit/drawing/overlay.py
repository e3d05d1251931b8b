"""A picture of a film with what was seen in it drawn over it."""

from collections.abc import Sequence

import cv2
import numpy as np

from mtm_audit.drawing.lettering import line_px, panel_size, put_panel, text_px
from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.palette import HALO, WHITE, Bgr
from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats

_SHIFT = 4  # fractional bits of places, so that lines do not tremble from pixel to pixel
_POINT_SHARE, _LEAST_REACH_PX = 0.012, 7.0  # of the picture's height: half a cross where no outline is known
_FARTHEST_PX = 1 << 14  # beyond any picture; places farther out would overflow

# Left, upper, right and lower edge in pixels.
_Box = tuple[int, int, int, int]


def draw(image: Image, marks: Sequence[Mark], caption: Sequence[str] = ()) -> Image:
    """A new picture (height, width, 3), blue, green and red: `image`, gray or coloured, with the marks over it.

    Each mark has its trail, its outline or else a cross, and a label with its name and notes, put where it hides no
    other as far as there is room; one that is not seen has a broken circle at its last place. The lines of `caption`
    stand in a strip below the picture, by which the new one is higher. Lines and letters grow with the picture's
    height. The same input gives the same picture, and `image` stays as it is.
    """
    shown = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    picture: Image = np.asarray(shown, dtype=np.uint8)
    for mark in marks:
        _draw_trail(picture, mark)
    for mark in marks:
        _draw_shape(picture, mark)
    taken = [_body_box(mark, picture.shape[0]) for mark in marks if mark.last_place is not None]
    for mark in marks:
        taken.append(_draw_label(picture, mark, taken))
    return _with_caption(picture, caption) if caption else picture


def polyline(image: Image, points: Floats, colour: Bgr, *, closed: bool, thick: int | None = None) -> None:
    """Draw a line with a dark edge through `points` (n, 2), columns and rows, in place."""
    width = line_px(image.shape[0]) if thick is None else thick
    fixed = np.rint(np.clip(points, -_FARTHEST_PX, _FARTHEST_PX) * (1 << _SHIFT)).astype(np.int32)
    for ink, breadth in ((HALO, width + 2), (colour, width)):
        cv2.polylines(image, [fixed], closed, ink, breadth, cv2.LINE_AA, _SHIFT)


def _draw_trail(image: Image, mark: Mark) -> None:
    seen = np.asarray(np.isfinite(mark.trail).all(axis=1))
    for run in np.split(np.arange(len(seen)), 1 + np.flatnonzero(np.diff(seen.astype(np.int8)))):
        if len(run) > 1 and seen[run[0]]:
            polyline(image, mark.trail[run], mark.colour, closed=False)


def _draw_shape(image: Image, mark: Mark) -> None:
    place = mark.last_place
    if place is None:
        return
    middle, reach = np.array(place), _reach_px(image.shape[0])
    if mark.place is None:
        turns = np.linspace(0.0, 2.0 * np.pi, 33)
        ring = middle + 2.0 * reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        for part in range(0, 32, 4):
            polyline(image, ring[part : part + 3], mark.colour, closed=False)
        return
    if mark.outline is None:
        for arm in ([reach, 0.0], [0.0, reach]):
            polyline(image, np.stack([middle - arm, middle + arm]), mark.colour, closed=False)
    else:
        polyline(image, mark.outline, mark.colour, closed=True)
    if mark.heading_rad is not None and np.isfinite(mark.heading_rad):
        ahead = np.array([np.cos(mark.heading_rad), -np.sin(mark.heading_rad)])
        length = 2.0 * reach if mark.outline is None else float(np.ptp(mark.outline, axis=0).max())
        polyline(image, np.stack([middle, middle + 0.8 * length * ahead]), mark.colour, closed=False)


def _with_caption(image: Image, lines: Sequence[str]) -> Image:
    size = text_px(image.shape[0])
    strip = np.zeros((panel_size(lines, size)[1], *image.shape[1:]), np.uint8)
    put_panel(strip, lines, (0, 0), size, [WHITE] * len(lines))
    return np.concatenate([image, strip])


def _draw_label(image: Image, mark: Mark, taken: Sequence[_Box]) -> _Box:
    """Write name and notes beside the mark, or at the left edge when it was never seen; returns the label's box."""
    lines = (mark.name, *mark.notes)
    size = text_px(image.shape[0])
    width, height = panel_size(lines, size)
    bar = 0 if mark.passed is None else max(size // 3, 3)
    left, top = _room(mark, (width, height + bar), image, taken)
    put_panel(image, lines, (left, top), size, [mark.colour, *[WHITE] * len(mark.notes)])
    if mark.passed is not None:
        passed = left + round(min(max(mark.passed, 0.0), 1.0) * (width - 1))
        rows = top + height, top + height + bar - 1
        cv2.rectangle(image, (left, rows[0]), (left + width - 1, rows[1]), HALO, cv2.FILLED)
        cv2.rectangle(image, (left, rows[0]), (passed, rows[1]), mark.colour, cv2.FILLED)
    return left, top, left + width, top + height + bar


def _room(mark: Mark, size: tuple[int, int], image: Image, taken: Sequence[_Box]) -> tuple[int, int]:
    """Where a label goes: the first place around its mark that hides nothing, or else the one that hides least."""
    width, height = size
    most = max(image.shape[1] - width, 0), max(image.shape[0] - height, 0)
    if mark.last_place is None:
        boxes = [(0, row) for row in range(0, most[1] + 1, max(height // 2, 1))]
    else:
        left, top, right, bottom = _body_box(mark, image.shape[0])
        middle = (left + right - width) // 2, (top + bottom - height) // 2
        boxes = [
            (middle[0], top - height), (middle[0], bottom), (right, middle[1]), (left - width, middle[1]),
            (right, top - height), (left - width, top - height), (right, bottom), (left - width, bottom),
            (middle[0], top - 2 * height), (middle[0], bottom + height),
        ]  # fmt: skip
    inside = [(min(max(left, 0), most[0]), min(max(top, 0), most[1])) for left, top in boxes]
    return min(inside, key=lambda corner: _hidden((*corner, corner[0] + width, corner[1] + height), taken))


def _reach_px(height_px: int) -> float:
    return max(_POINT_SHARE * height_px, _LEAST_REACH_PX)


def _hidden(box: _Box, taken: Sequence[_Box]) -> int:
    """How many pixels of other things a box would lie on."""
    return sum(
        max(min(box[2], other[2]) - max(box[0], other[0]), 0) * max(min(box[3], other[3]) - max(box[1], other[1]), 0)
        for other in taken
    )


def _body_box(mark: Mark, height_px: int) -> _Box:
    """What the drawn shape takes, with a small margin."""
    assert mark.last_place is not None
    reach = 2.0 * _reach_px(height_px)
    around = np.array(mark.last_place) + np.array([[-reach, -reach], [reach, reach]])
    corners = np.concatenate([around, mark.outline]) if mark.outline is not None and mark.place else around
    corners = np.clip(corners, -_FARTHEST_PX, _FARTHEST_PX)
    margin = line_px(height_px) + 2
    low, high = np.floor(corners.min(axis=0)).astype(int) - margin, np.ceil(corners.max(axis=0)).astype(int) + margin
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])
