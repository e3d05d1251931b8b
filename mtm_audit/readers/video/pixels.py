"""Decoded pictures as arrays, gray or coloured."""

from typing import TYPE_CHECKING

import numpy as np

from mtm_audit.model.picture import Image, Pixels

if TYPE_CHECKING:
    from av import VideoFrame

# Formats whose first plane is the gray picture itself, so that gray costs no conversion.
_LUMA_8 = frozenset(
    {"gray", "yuv420p", "yuvj420p", "yuv422p", "yuvj422p", "yuv440p", "yuvj440p", "yuv444p", "yuvj444p", "nv12", "nv16"}
)
# Formats whose first plane is gray in 16-bit words, and what takes white to 255.
_LUMA_16 = {
    **{f"yuv{chroma}p{bits}le": 2.0 ** (8 - bits) for chroma in ("420", "422", "444") for bits in (10, 12)},
    **{f"gray{bits}le": 2.0 ** (8 - bits) for bits in (10, 12, 16)},
    "p010le": 2.0**-8,
}
# Of ITU-T H.273: the matrices by the number that stands in the file, as the library names them. BT.2020's two differ
# in a way that 8-bit colours do not show.
_BT601 = 5
_MATRICES = {1: 1, 4: 4, 5: _BT601, 6: _BT601, 7: 7, 9: 9, 10: 9}
_FULL_RANGE = 2


def image_of(picture: "VideoFrame", pixels: Pixels) -> Image:
    """The picture, shape (height, width) gray or (height, width, 3) in the order blue, green, red.

    Gray is the luma as it is stored, where there is one. Colours follow the matrix and the range that the file states;
    BT.601 and the usual range of the format where it states none. The array may be a view of the decoder's memory.
    """
    return _gray(picture) if pixels == "gray" else _bgr(picture)


def _gray(picture: "VideoFrame") -> Image:
    name, plane = picture.format.name, picture.planes[0]
    if plane.line_size > 0 and name in _LUMA_8:
        return _rows(picture, np.uint8)
    if plane.line_size > 0 and name in _LUMA_16:
        import cv2

        return np.asarray(cv2.convertScaleAbs(_rows(picture, np.uint16), alpha=_LUMA_16[name]), dtype=np.uint8)
    return np.asarray(picture.to_ndarray(format="gray"), dtype=np.uint8)


def _rows(picture: "VideoFrame", word: type[np.uint8] | type[np.uint16]) -> np.ndarray:
    plane = picture.planes[0]
    rows = np.frombuffer(memoryview(plane), word).reshape(-1, plane.line_size // np.dtype(word).itemsize)
    return rows[: picture.height, : picture.width]


def _bgr(picture: "VideoFrame") -> Image:
    matrix = _MATRICES.get(int(picture.colorspace), _BT601)
    full = int(picture.color_range) == _FULL_RANGE
    even = picture.width % 2 == picture.height % 2 == 0
    if picture.format.name == "yuv420p" and matrix == _BT601 and not full and even:
        import cv2

        # OpenCV rounds the most common format better, and as fast.
        return np.asarray(cv2.cvtColor(picture.to_ndarray(), cv2.COLOR_YUV2BGR_I420), dtype=np.uint8)
    from av.video.reformatter import ColorRange, Colorspace

    coloured = picture.reformat(
        format="bgr24",
        src_colorspace=Colorspace(matrix),
        src_color_range=ColorRange.JPEG if full else ColorRange.UNSPECIFIED,
        dst_color_range=ColorRange.JPEG,
    )
    return np.asarray(coloured.to_ndarray(), dtype=np.uint8)
