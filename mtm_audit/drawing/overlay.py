"""A picture of a film with what was seen in it drawn over it."""

from collections.abc import Sequence

import cv2
import numpy as np

from mtm_audit.drawing.lettering import line_px, panel_size, put_panel, text_px, wrapped
from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.palette import HALO, WHITE, Bgr
from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats

_SHIFT = 4  # fractional bits of places, so that lines do not tremble from pixel to pixel
_POINT_SHARE, _LEAST_REACH_PX = 0.012, 7.0  # of the picture's height: half a cross where no outline is known
_RINGS = 4  # label heights from its mark that a label may be away
_LEAST_LEAD_PX = 6.0
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
    _draw_labels(picture, marks)
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
    lines = wrapped(lines, size, image.shape[1])
    strip = np.zeros((panel_size(lines, size)[1], *image.shape[1:]), np.uint8)
    put_panel(strip, lines, (0, 0), size, [WHITE] * len(lines))
    return np.concatenate([image, strip])


def _draw_labels(image: Image, marks: Sequence[Mark]) -> None:
    """Write name and notes beside each mark, or at the left edge for one that was never seen."""
    taken = [_body_box(mark, image.shape[0]) for mark in marks if mark.last_place is not None]
    boxes = []
    for mark in marks:
        boxes.append(_room(mark, _label_size(mark, image.shape[0]), image, taken))
        taken.append(boxes[-1])
    for mark, box in zip(marks, boxes, strict=True):
        _lead(image, mark, box)
    for mark, box in zip(marks, boxes, strict=True):
        _draw_label(image, mark, box)


def _label_size(mark: Mark, height_px: int) -> tuple[int, int]:
    width, height = panel_size((mark.name, *mark.notes), text_px(height_px))
    return width, height + _bar_px(mark, height_px)


def _bar_px(mark: Mark, height_px: int) -> int:
    return 0 if mark.passed is None else max(text_px(height_px) // 3, 3)


def _draw_label(image: Image, mark: Mark, box: _Box) -> None:
    left, top, right, bottom = box
    colours = [mark.colour, *[WHITE] * len(mark.notes)]
    put_panel(image, (mark.name, *mark.notes), (left, top), text_px(image.shape[0]), colours)
    if mark.passed is not None:
        passed = left + round(min(max(mark.passed, 0.0), 1.0) * (right - left - 1))
        upper = bottom - _bar_px(mark, image.shape[0])
        cv2.rectangle(image, (left, upper), (right - 1, bottom - 1), HALO, cv2.FILLED)
        cv2.rectangle(image, (left, upper), (passed, bottom - 1), mark.colour, cv2.FILLED)


def _room(mark: Mark, size: tuple[int, int], image: Image, taken: Sequence[_Box]) -> _Box:
    """Where a label goes: the nearest place around its mark that hides nothing, or else the one that hides least."""
    width, height = size
    most = max(image.shape[1] - width, 0), max(image.shape[0] - height, 0)
    if mark.last_place is None:
        boxes = [(0, row) for row in range(0, most[1] + 1, max(height // 2, 1))]
    else:
        around = _body_box(mark, image.shape[0])
        boxes = [box for ring in range(_RINGS) for box in _beside(_grown(around, ring * height), size)]
    inside = [(min(max(left, 0), most[0]), min(max(top, 0), most[1])) for left, top in boxes]
    places = [(left, top, left + width, top + height) for left, top in inside]
    return min(places, key=lambda place: _hidden(place, taken))


def _beside(box: _Box, size: tuple[int, int]) -> list[tuple[int, int]]:
    """Upper left corners of labels of a size that touch a box from outside, those above and below it first."""
    (left, top, right, bottom), (width, height) = box, size
    middle = (left + right - width) // 2, (top + bottom - height) // 2
    return [
        (middle[0], top - height), (middle[0], bottom), (right, middle[1]), (left - width, middle[1]),
        (right, top - height), (left - width, top - height), (right, bottom), (left - width, bottom),
    ]  # fmt: skip


def _grown(box: _Box, margin: int) -> _Box:
    return box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin


def _lead(image: Image, mark: Mark, box: _Box) -> None:
    """Draw a line from a label to its mark where they do not touch."""
    if mark.last_place is None:
        return
    body = np.array(_body_box(mark, image.shape[0]), dtype=float)
    middle = np.array(mark.last_place)
    start = np.clip(middle, box[:2], box[2:])
    end = np.clip(start, body[:2], body[2:])
    if np.linalg.norm(end - start) > _LEAST_LEAD_PX:
        polyline(image, np.stack([start, end]), mark.colour, closed=False, thick=1)


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
