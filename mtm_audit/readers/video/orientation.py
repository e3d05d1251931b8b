"""How players turn a picture before they show it."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from mtm_audit.model.picture import Image

if TYPE_CHECKING:
    from av import VideoFrame
    from av.sidedata.sidedata import SideData

_ONE = 1 << 16
# Matrices are exact multiples of a quarter turn, give or take what fixed point rounds.
_SLACK = _ONE // 100


@dataclass(frozen=True)
class Orientation:
    """Swap rows and columns first where `transposed`, then mirror left and right, then upper and lower."""

    transposed: bool = False
    left_right: bool = False
    upper_lower: bool = False

    def shown(self, image: Image) -> Image:
        """The picture as it is shown, shape (height, width) or (height, width, 3); itself when nothing is turned."""
        if self == Orientation():
            return image
        import cv2

        turned = cv2.transpose(image) if self.transposed else image
        if self.left_right or self.upper_lower:
            code = -1 if self.left_right and self.upper_lower else int(self.left_right)
            turned = cv2.flip(turned, code)
        return np.asarray(turned, dtype=np.uint8)


def orientation_of(picture: "VideoFrame") -> Orientation | None:
    """What the picture's display matrix asks for; None when that is no multiple of a quarter turn.

    The matrix takes columns p and rows q to columns a p + c q and rows b p + d q, in 16.16 fixed point, stored in the
    order a, b, u, c, d, v, x, y, w (ISO/IEC 14496-12, 8.3.2).
    """
    from av.sidedata.sidedata import Type

    beside = cast("Mapping[Type, SideData]", picture.side_data)
    matrix = beside.get(Type.DISPLAYMATRIX)
    if matrix is None:
        return Orientation()
    a, b, _, c, d, *_ = struct.unpack("=9i", bytes(matrix)[:36])
    if max(abs(b), abs(c)) <= _SLACK and min(abs(a), abs(d)) > 0:
        return Orientation(False, a < 0, d < 0)
    if max(abs(a), abs(d)) <= _SLACK and min(abs(b), abs(c)) > 0:
        return Orientation(True, c < 0, b < 0)
    return None
