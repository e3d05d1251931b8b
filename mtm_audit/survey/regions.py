"""Where things move in pictures that show nothing to go by."""

from collections.abc import Sequence

import cv2
import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.region import LEAST_SIDE_PX, Region

_WIDTH_PX = 480
_LEAST_CHANGE = 25  # gray levels
_LEAST_SHARE, _MOST_SHARE = 3e-4, 0.2  # of the picture
_MOST = 6


def moving_regions(frames: Sequence[Frame]) -> tuple[Region, ...]:
    """Regions of the first picture with something in them that is elsewhere in most of the others, the largest first.

    Of a camera that moves they mean nothing. Empty for fewer than three pictures.
    """
    if len(frames) < 3:
        return ()
    width, height = frames[0].size
    scale = min(_WIDTH_PX / width, 1.0)
    size = max(round(scale * width), 1), max(round(scale * height), 1)
    small = np.stack([cv2.resize(_gray(frame), size, interpolation=cv2.INTER_AREA) for frame in frames])
    usual = np.median(small[1:], axis=0)
    changed = (np.abs(small[0] - usual) > _LEAST_CHANGE).astype(np.uint8)
    changed = np.asarray(cv2.morphologyEx(changed, cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8)))
    _, _, boxes, _ = cv2.connectedComponentsWithStats(changed, connectivity=8)
    found: list[Region] = []
    for left, upper, wide, high, area in sorted(boxes[1:].tolist(), key=lambda box: -box[4]):
        if not _LEAST_SHARE * changed.size <= area <= _MOST_SHARE * changed.size:
            continue
        edges = [round(edge / scale) for edge in (left, upper, left + wide, upper + high)]
        if min(edges[2] - edges[0], edges[3] - edges[1]) >= LEAST_SIDE_PX:
            found.append((edges[0], edges[1], min(edges[2], width), min(edges[3], height)))
    return tuple(found[:_MOST])


def _gray(frame: Frame) -> np.ndarray:
    image = frame.image
    return np.asarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
