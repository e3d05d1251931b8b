"""The lens of a camera as a calibration describes it."""

from dataclasses import dataclass
from typing import Literal

LensModel = Literal["radial", "fisheye"]


@dataclass(frozen=True, kw_only=True)
class Lens:
    """How directions become places in a picture, by the conventions of OpenCV.

    It holds for pictures of `size_px` (width, height). `focal_px` are the focal lengths across and down, `centre_px`
    the column and row of the axis. `distortion` are the coefficients of the `model`: of "radial" k1, k2, p1, p2 and
    perhaps k3 to k6 and more (4, 5, 8, 12 or 14), of "fisheye" k1 to k4 (the equidistant model). `name` is what people
    call it.
    """

    name: str
    size_px: tuple[int, int]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...]
    model: LensModel = "radial"
