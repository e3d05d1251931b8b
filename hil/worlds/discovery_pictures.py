"""Pictures of Discovery as VMAS's viewer draws it: targets with their covering ranges, the agent, its lidar's rays.

Circles are polygons of 30 corners; their areas have hard edges (a pixel is filled when its centre is inside), and
lines, among them a border half as bright as the area, are smooth and one pixel wide. The agent is half transparent.
"""

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

import cv2
import numpy as np

from hil.worlds.vmas_pictures import native_image, scale_px, to_pixels
from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

PICTURE_PX = (704, 704)
AGENT_COLOUR = "#4040bf"  # its hue, whatever shines through

_ZOOM = 1.0
_SCALE_PX = scale_px(PICTURE_PX, _ZOOM)
_AGENT_BGR, _AGENT_ALPHA = (191.25, 63.75, 63.75), 0.5
_TARGET_BGR = (63.75, 191.25, 63.75)
_BOUNDARY_BGR = (63.75, 63.75, 63.75)
_RADIUS_M = 0.05
_COVERING_RANGE_M = 0.25
_CORNERS = 30
_RAYS = 15
_RANGE_M = 0.35
_RAY_END_M = 0.01
_SHIFT = 8

_RAY_ANGLES_RAD = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
_RAY_DIRECTIONS = np.stack([np.cos(_RAY_ANGLES_RAD), np.sin(_RAY_ANGLES_RAD)], axis=1)
_EDGE_ANGLES_RAD = 2.0 * np.pi * (np.arange(_CORNERS) + 0.5) / _CORNERS
_EDGE_NORMALS = np.stack([np.cos(_EDGE_ANGLES_RAD), np.sin(_EDGE_ANGLES_RAD)])


def draw(positions_m: Floats, targets_m: Floats) -> Iterator[Image]:
    """A picture for each position (n, 2) of the agent among targets (m, 2), all in metres."""
    background = _background(tuple(map(tuple, targets_m)))
    centres_px = to_pixels(positions_m, PICTURE_PX, _ZOOM)
    ends_px = to_pixels(ray_ends(positions_m, targets_m), PICTURE_PX, _ZOOM)
    for centre_px, own_ends_px in zip(centres_px, ends_px, strict=True):
        image = background.copy()
        _circle(image, centre_px, _RADIUS_M * _SCALE_PX, _AGENT_BGR, _AGENT_ALPHA)
        for end_px in own_ends_px:
            cv2.line(image, _fixed(centre_px), _fixed(end_px), (0, 0, 0), 1, cv2.LINE_AA, _SHIFT)
            _dot(image, end_px)
        yield image


def draw_natively(env: "Environment", positions_m: Floats) -> Iterator[Image]:
    """The same by VMAS's viewer; raises MtmError when there is neither EGL nor a display for it."""
    import torch

    env.scenario.viewer_size = PICTURE_PX
    agent = env.world.agents[0]
    for position_m in positions_m:
        agent.set_pos(torch.tensor(position_m[None], dtype=torch.float32), batch_index=None)
        agent.sensors[0].measure()
        yield native_image(env)


def ray_ends(positions_m: Floats, targets_m: Floats) -> Floats:
    """Where the lidar's rays end, (n, 15, 2): at the first target's surface, or at the lidar's range."""
    ways_m = targets_m - positions_m[:, None]
    along_m = ways_m @ _RAY_DIRECTIONS.T
    across_m = ways_m @ (_RAY_DIRECTIONS[:, ::-1] * np.array([-1.0, 1.0])).T
    depths_m = np.sqrt(np.maximum(_RADIUS_M**2 - across_m**2, 0.0))
    hit = (along_m > 0.0) & (np.abs(across_m) < _RADIUS_M)
    lengths_m = np.minimum(np.where(hit, along_m - depths_m, np.inf).min(axis=1), _RANGE_M)
    return np.asarray(positions_m[:, None] + lengths_m[..., None] * _RAY_DIRECTIONS)


@cache
def _background(targets_m: tuple[tuple[float, ...], ...]) -> Image:
    width, height = PICTURE_PX
    image = np.full((height, width, 3), 255, dtype=np.uint8)
    corners = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)], dtype=np.float64)
    _outline(image, to_pixels(corners, PICTURE_PX, _ZOOM), _BOUNDARY_BGR)
    centres_px = to_pixels(np.array(targets_m), PICTURE_PX, _ZOOM)
    angles_rad = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    ring_px = _COVERING_RANGE_M * _SCALE_PX * np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
    for centre_px in centres_px:
        _outline(image, centre_px + ring_px, _TARGET_BGR)
    for centre_px in centres_px:
        _circle(image, centre_px, _RADIUS_M * _SCALE_PX, _TARGET_BGR, 1.0)
    return image


def _circle(image: Image, centre_px: Floats, radius_px: float, bgr: tuple[float, ...], alpha: float) -> None:
    """Area and border of a polygon of 30 corners, in place; what of it is outside the picture is left out."""
    height, width, _ = image.shape
    left, top = np.maximum(np.floor(centre_px - radius_px - 1), 0).astype(int)
    right, bottom = np.minimum(np.ceil(centre_px + radius_px + 2), (width, height)).astype(int)
    if left >= right or top >= bottom:
        return
    columns, rows = np.arange(left, right) - centre_px[0], np.arange(top, bottom) - centre_px[1]
    # Distance of each pixel's centre from the polygon's edge, positive outside.
    outward = np.multiply.outer(rows, _EDGE_NORMALS[1])[:, None] + np.multiply.outer(columns, _EDGE_NORMALS[0])[None]
    beyond_px = outward.max(axis=2) - radius_px * np.cos(np.pi / _CORNERS)
    area = (alpha * (beyond_px <= 0.0))[..., None]
    border = (0.5 * alpha * np.clip(1.0 - np.abs(beyond_px), 0.0, 1.0))[..., None]
    window = image[top:bottom, left:right]
    colour = np.array(bgr)
    blended = window * (1.0 - area) + area * colour
    window[:] = np.rint(blended * (1.0 - border) + border * 0.5 * colour)


def _dot(image: Image, centre_px: Floats) -> None:
    """The end of a ray: too small a circle for its corners to show, so drawn by OpenCV, which is quicker."""
    radius_px = _RAY_END_M * _SCALE_PX
    border = tuple(0.5 * value for value in _TARGET_BGR)
    for radius, bgr in ((radius_px + 0.25, border), (radius_px - 0.75, _TARGET_BGR)):
        cv2.circle(image, _fixed(centre_px), round(radius * 2**_SHIFT), bgr, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _outline(image: Image, corners_px: Floats, bgr: tuple[float, ...]) -> None:
    points = np.array([_fixed(corner_px) for corner_px in corners_px], dtype=np.int32)
    cv2.polylines(image, [points], True, bgr, 1, cv2.LINE_AA, _SHIFT)


def _fixed(point_px: Floats) -> tuple[int, int]:
    """OpenCV's fixed-point coordinates."""
    column, row = np.rint(point_px * 2**_SHIFT).astype(int)
    return int(column), int(row)
