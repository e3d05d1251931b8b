"""Textures of the floor and of robots from above, drawn once at a fixed resolution."""

from collections.abc import Sequence
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.picture import Image

FloorKind = Literal["mat", "carpet"]
TEXELS_PER_M = 600  # a multiple that gives each module of a marker a whole number of texels
ROBOT_LENGTH_M, ROBOT_WIDTH_M, ROBOT_HEIGHT_M = 0.32, 0.24, 0.20
MARKER_M, QUIET_ZONE_M = 0.18, 0.03
TOP_SPAN_M = (0.36, 0.30)  # length and width of the top's picture: body and wheels
SHADOW_SPAN_M = (0.60, 0.52)
FLOOR_TEXELS_PER_M = 240
TILE_M = 0.5

BODY_BGR, TRIM_BGR, WHEEL_BGR, HUB_BGR = (52, 48, 46), (205, 210, 210), (24, 24, 26), (96, 96, 98)
MAT_BGR, SEAM_BGR, BORDER_BGR, SURROUND_BGR = (178, 178, 172), (160, 160, 154), (206, 208, 210), (110, 114, 118)


def marker_top(number: int) -> Image:
    """Premultiplied BGRA picture of a robot's top with the ArUco marker (4x4, 50 markers) `number` on it."""
    top = _body()
    side = round(MARKER_M * TEXELS_PER_M)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    marker = cv2.aruco.generateImageMarker(dictionary, number, side)
    _fill(top, (0.0, 0.0), (MARKER_M + 2 * QUIET_ZONE_M,) * 2, (245, 245, 245))
    row, column = (top.shape[0] - side) // 2, (top.shape[1] - side) // 2
    top[row : row + side, column : column + side, :3] = np.clip(marker, 16, 245)[:, :, None]
    return top


def coloured_top(colour_bgr: tuple[int, int, int]) -> Image:
    """Premultiplied BGRA picture of a robot's top under a plain square of one colour."""
    top = _body()
    _fill(top, (0.0, 0.0), (0.20, 0.20), colour_bgr)
    return top


def covered_top() -> Image:
    """Premultiplied BGRA picture of a robot under a plain cloth, which is what an occluded robot looks like."""
    top = np.zeros(_shape(TOP_SPAN_M, TEXELS_PER_M), np.uint8)
    _fill(top, (0.0, 0.0), TOP_SPAN_M, (92, 96, 100))
    return top


def shadow() -> NDArray[np.float32]:
    """Share of the light that the floor loses under and around a robot, shape (rows, columns)."""
    rows, columns, _ = _shape(SHADOW_SPAN_M, TEXELS_PER_M)
    mask = np.zeros((rows, columns), np.float32)
    margin_x, margin_y = (round((SHADOW_SPAN_M[i] - TOP_SPAN_M[i]) / 2 * TEXELS_PER_M) for i in range(2))
    mask[margin_y:-margin_y, margin_x:-margin_x] = 0.5
    return np.asarray(cv2.GaussianBlur(mask, (0, 0), 0.03 * TEXELS_PER_M), dtype=np.float32)


def floor(
    length_m: float, width_m: float, kind: FloorKind = "mat", markers: Sequence[tuple[int, float, float]] = ()
) -> Image:
    """BGR picture of the arena's floor: a mat of tiles with faint grain, or a carpet, and a bright border.

    `markers` lie on it, each a number with x and y of its middle in metres.
    """
    columns, rows = round(length_m * FLOOR_TEXELS_PER_M), round(width_m * FLOOR_TEXELS_PER_M)
    grain = np.random.default_rng(1)
    mat = np.full((rows, columns, 3), MAT_BGR, np.float32)
    tile = round(TILE_M * FLOOR_TEXELS_PER_M)
    for row in range(0, rows, tile):
        for column in range(0, columns, tile):
            mat[row : row + tile, column : column + tile] += grain.normal(0, 2.5)
    for seam in range(tile, rows, tile):
        mat[seam - 1 : seam + 1] = SEAM_BGR
    for seam in range(tile, columns, tile):
        mat[:, seam - 1 : seam + 1] = SEAM_BGR
    cv2.rectangle(mat, (0, 0), (columns - 1, rows - 1), BORDER_BGR, round(0.04 * FLOOR_TEXELS_PER_M))
    coarse = cv2.GaussianBlur(grain.normal(0, 22, mat.shape[:2]).astype(np.float32), (0, 0), 4)
    if kind == "carpet":
        for size, levels in ((2.0, 120), (7.0, 260)):
            pile = cv2.GaussianBlur(grain.normal(0, levels, mat.shape[:2]).astype(np.float32), (0, 0), size)
            mat = mat + pile[:, :, None]
    ground = np.asarray(np.clip(mat + coarse[:, :, None], 0, 255), dtype=np.uint8)
    for number, x_m, y_m in markers:
        _lay_marker(ground, number, x_m, y_m)
    return ground


def _lay_marker(ground: Image, number: int, x_m: float, y_m: float) -> None:
    cell = round(MARKER_M / 6 * FLOOR_TEXELS_PER_M)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    marker = np.clip(cv2.aruco.generateImageMarker(dictionary, number, 6 * cell), 16, 245)
    sheet = cv2.copyMakeBorder(marker, *(cell,) * 4, cv2.BORDER_CONSTANT, value=245)
    row = round(ground.shape[0] / 2 - y_m * FLOOR_TEXELS_PER_M) - len(sheet) // 2
    column = round(ground.shape[1] / 2 + x_m * FLOOR_TEXELS_PER_M) - len(sheet) // 2
    ground[row : row + len(sheet), column : column + len(sheet)] = sheet[:, :, None]


def _shape(span_m: tuple[float, float], texels_per_m: int) -> tuple[int, int, int]:
    return round(span_m[1] * texels_per_m), round(span_m[0] * texels_per_m), 4


def _body() -> Image:
    """Chassis with its front to the right, four wheels, and a strip of light along the front."""
    top = np.zeros(_shape(TOP_SPAN_M, TEXELS_PER_M), np.uint8)
    for x in (-0.105, 0.105):
        for y in (-0.125, 0.125):
            _fill(top, (x, y), (0.10, 0.05), WHEEL_BGR)
            for offset in (-0.03, 0.0, 0.03):
                _fill(top, (x + offset, y), (0.008, 0.05), HUB_BGR)
    _fill(top, (0.0, 0.0), (ROBOT_LENGTH_M, ROBOT_WIDTH_M), BODY_BGR)
    _fill(top, (ROBOT_LENGTH_M / 2 - 0.02, 0.0), (0.016, 0.18), TRIM_BGR)
    return top


def _fill(
    top: Image, centre_m: tuple[float, float], size_m: tuple[float, float], colour_bgr: tuple[int, int, int]
) -> None:
    """Paint an opaque rectangle; `centre_m` from the middle of the top, x forward and y to the left."""
    left = round((TOP_SPAN_M[0] / 2 + centre_m[0] - size_m[0] / 2) * TEXELS_PER_M)
    upper = round((TOP_SPAN_M[1] / 2 - centre_m[1] - size_m[1] / 2) * TEXELS_PER_M)
    right, lower = left + round(size_m[0] * TEXELS_PER_M), upper + round(size_m[1] * TEXELS_PER_M)
    top[max(upper, 0) : lower, max(left, 0) : right] = (*colour_bgr, 255)
