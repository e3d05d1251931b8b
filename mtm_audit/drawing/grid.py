"""A grid of pixel numbers over a picture, so that places and regions can be read off."""

import numpy as np

from mtm_audit.drawing.lettering import panel_size, put_panel, text_px
from mtm_audit.drawing.palette import WHITE
from mtm_audit.model.picture import Image

_LINES = 20  # along the longer side, about
_LEAST_STEP_PX = 10


def grid_step_px(size: tuple[int, int]) -> int:
    """How far apart lines are in a picture of that width and height: 1, 2 or 5 times a power of ten."""
    wanted = max(max(size) / _LINES, _LEAST_STEP_PX)
    power = 10 ** int(np.floor(np.log10(wanted)))
    return int(next(step * power for step in (1, 2, 5, 10) if step * power >= wanted))


def draw_grid(image: Image) -> Image:
    """The picture (height, width, 3) with lines every so many pixels and their numbers along two edges.

    Numbers count from the upper left corner, to the right and down, as regions of trackers do.
    """
    shown = image.copy()
    height, width = shown.shape[:2]
    step = grid_step_px((width, height))
    for column in range(step, width, step):
        _tint(shown[:, column : column + 1])
    for row in range(step, height, step):
        _tint(shown[row : row + 1])
    size_px = max(round(0.7 * text_px(height)), 9)
    wide, high = panel_size([str(max(width, height))], size_px)
    for column in range(_apart(step, wide), width - wide // 2, _apart(step, wide)):
        put_panel(shown, [str(column)], (column, 0), size_px, [WHITE])
    for row in range(_apart(step, high), height - high // 2, _apart(step, high)):
        put_panel(shown, [str(row)], (0, row), size_px, [WHITE])
    return shown


def _apart(step: int, size_px: int) -> int:
    """How far apart numbers stand: some lines, so that there is room between them."""
    return step * -(-5 * size_px // (4 * step))


def _tint(pixels: Image) -> None:
    """Darken bright pixels and brighten dark ones, in place, so that a line shows on both."""
    pixels[:] = np.where(pixels > 127, pixels - 70, pixels + 70)
