"""A contact sheet: pictures of a film beside and below each other."""

from collections.abc import Sequence

import numpy as np

from mtm_audit.drawing.lettering import panel_size, put_panel, text_px
from mtm_audit.drawing.palette import WHITE
from mtm_audit.model.picture import Image

_GAP_PX = 8


def contact_sheet(pictures: Sequence[Image], header: Sequence[str], columns: int = 3) -> Image:
    """A picture of the `header`'s lines and, below, of all pictures (height, width, 3), which are of one size.

    Raises ValueError when there is no picture.
    """
    if not pictures:
        raise ValueError("a contact sheet needs a picture")
    height, width = pictures[0].shape[:2]
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    size_px = text_px(height) + 3
    wide = max(_GAP_PX + columns * (width + _GAP_PX), panel_size(header, size_px)[0])
    top = panel_size(header, size_px)[1] + _GAP_PX
    sheet = np.full((top + rows * (height + _GAP_PX), wide, 3), 32, np.uint8)
    put_panel(sheet, header, (0, _GAP_PX // 2), size_px, [WHITE] * len(header))
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        upper, left = top + row * (height + _GAP_PX), _GAP_PX + column * (width + _GAP_PX)
        sheet[upper : upper + height, left : left + width] = picture
    return sheet
