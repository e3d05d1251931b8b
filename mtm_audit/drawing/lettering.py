"""Letters in pictures, smooth and in any alphabet that the fonts of matplotlib have."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from mtm_audit.drawing.palette import Bgr
from mtm_audit.model.picture import Image

# Of the picture's height, so that text is read alike on a phone's film and on a surveillance camera's.
_TEXT_SHARE, _LEAST_TEXT_PX = 1 / 38, 11
_LINE_SHARE, _LEAST_LINE_PX = 1 / 480, 1
_DARKENED = 0.35  # what is left of the picture under a panel


def text_px(height_px: int) -> int:
    """How large letters are in a picture of that height."""
    return max(round(_TEXT_SHARE * height_px), _LEAST_TEXT_PX)


def line_px(height_px: int) -> int:
    """How thick lines are in a picture of that height."""
    return max(round(_LINE_SHARE * height_px), _LEAST_LINE_PX)


def text_size(text: str, size_px: int) -> tuple[int, int]:
    """Width and height in pixels of one line of text, the room between lines included."""
    return _mask(text, size_px).shape[1], round(1.3 * size_px)


def put_text(image: Image, text: str, corner: tuple[int, int], size_px: int, colour: Bgr) -> None:
    """Write one line into `image` (height, width, 3), in place; `corner` is its upper left column and row.

    What lies beyond the picture is cut off.
    """
    mask = _mask(text, size_px)
    left, top = corner
    rows = slice(max(top, 0), min(top + mask.shape[0], image.shape[0]))
    columns = slice(max(left, 0), min(left + mask.shape[1], image.shape[1]))
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    cover = mask[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left, None]
    under = image[rows, columns]
    image[rows, columns] = (under + cover * (np.asarray(colour, np.float32) - under) + 0.5).astype(np.uint8)


def wrapped(lines: Sequence[str], size_px: int, width_px: int) -> list[str]:
    """The lines cut between words so that each fits into a panel of that width; a word that does not stays whole."""
    room_px = width_px - 2 * (size_px // 3)
    fitting: list[str] = []
    for line in lines:
        own = ""
        for word in line.split(" "):
            longer = f"{own} {word}" if own else word
            if own and text_size(longer, size_px)[0] > room_px:
                fitting.append(own)
                longer = word
            own = longer
        fitting.append(own)
    return fitting


def panel_size(lines: Sequence[str], size_px: int) -> tuple[int, int]:
    """Width and height in pixels of a panel of those lines."""
    sizes = [text_size(line, size_px) for line in lines]
    margin = size_px // 3
    return max((width for width, _ in sizes), default=0) + 2 * margin, sum(high for _, high in sizes) + 2 * margin


def put_panel(
    image: Image, lines: Sequence[str], corner: tuple[int, int], size_px: int, colours: Sequence[Bgr]
) -> None:
    """Write lines, each in its own colour, on a darkened panel whose upper left column and row is `corner`."""
    width, height = panel_size(lines, size_px)
    left, top = corner
    rows, columns = slice(max(top, 0), max(top + height, 0)), slice(max(left, 0), max(left + width, 0))
    image[rows, columns] = (_DARKENED * image[rows, columns]).astype(np.uint8)
    margin = size_px // 3
    row = top + margin
    for line, colour in zip(lines, colours, strict=True):
        put_text(image, line, (left + margin, row), size_px, colour)
        row += text_size(line, size_px)[1]


@lru_cache(maxsize=2048)
def _mask(text: str, size_px: int) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """How much of each pixel the letters cover, 0 to 1; the rows are those from the font's top to its bottom."""
    from PIL import Image as Pictures
    from PIL import ImageDraw, ImageFont

    font = ImageFont.truetype(str(_font_file()), size_px)
    height = sum(font.getmetrics())
    picture = Pictures.new("L", (max(round(font.getlength(text)), 1), height))
    ImageDraw.Draw(picture).text((0, 0), text, font=font, fill=255)
    return np.asarray(picture, dtype=np.float32) / 255.0


@lru_cache
def _font_file() -> Path:
    from matplotlib import get_data_path

    return Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans-Bold.ttf"
