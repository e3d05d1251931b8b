"""The geometry of a pinhole camera with radial distortion."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from hil.sensors.poses import Floats
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True, kw_only=True)
class Optics:
    """Where the camera stands, where it looks, and how it maps rays to pixels.

    `position_m` and `target_m` are points of the world frame (z up); the picture's upper edge points to +z, or to
    +y when the camera looks straight down, before it is turned clockwise by `roll_rad`. A ray at the distance r from
    the axis (r = 1 at 45 degrees) lands at `focal_px` * r * (1 + k1 r^2 + k2 r^4), with `radial` = (k1, k2), which
    must keep that increasing within the picture. `mirrored` swaps left and right. `turn_rad` turns the camera from
    that aim: a rotation vector about its own axes whose first angle pans to the right, the second tilts down and the
    third rolls clockwise. Pixel centres have whole coordinates, x to the right and y down.
    """

    position_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    focal_px: float
    width_px: int = 704
    height_px: int = 704
    roll_rad: float = 0.0
    radial: tuple[float, float] = (0.0, 0.0)
    mirrored: bool = False
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.position_m == self.target_m:
            raise MtmError("the camera looks at its own position; move its target")

    @cached_property
    def rotation(self) -> Floats:
        """World to camera, shape (3, 3): rows are the picture's right, its down, and the viewing direction."""
        forward = np.subtract(self.target_m, self.position_m)
        forward = forward / np.linalg.norm(forward)
        up = np.array([0.0, 1.0, 0.0]) if abs(forward[2]) > 0.9999 else np.array([0.0, 0.0, 1.0])
        right = np.cross(forward, up)
        right = right / np.linalg.norm(right)
        down = np.cross(forward, right)
        cos, sin = np.cos(self.roll_rad), np.sin(self.roll_rad)
        aimed = np.stack([cos * right + sin * down, cos * down - sin * right, forward])
        pan, tilt, roll = self.turn_rad
        turned, _ = cv2.Rodrigues(np.array([tilt, -pan, -roll]))
        return np.asarray(turned @ aimed)

    def project(self, points_m: Floats) -> Floats:
        """Pixels (n, 2) of world points (n, 3), which must lie in front of the camera."""
        x, y, depth = self.rotation @ (points_m - np.asarray(self.position_m)).T
        x, y = x / depth, y / depth
        square = x**2 + y**2
        scale = self.focal_px * (1 + self.radial[0] * square + self.radial[1] * square**2)
        columns = x * scale + (self.width_px - 1) / 2
        if self.mirrored:
            columns = self.width_px - 1 - columns
        return np.stack([columns, y * scale + (self.height_px - 1) / 2], axis=1)

    def plane_xy_m(self, height_m: float) -> Floats:
        """World x and y of what every pixel sees of the horizontal plane at `height_m`.

        Shape (height, width, 2); NaN where the pixel looks past the plane.
        """
        slopes = self.slopes()
        rays = np.concatenate([slopes, np.ones_like(slopes[..., :1])], axis=-1) @ self.rotation
        drop = height_m - self.position_m[2]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.where(drop / rays[..., 2] > 0, drop / rays[..., 2], np.nan)
        return np.asarray(np.asarray(self.position_m)[:2] + rays[..., :2] * distance[..., None], dtype=np.float64)

    def slopes(self) -> Floats:
        """Of every pixel's ray, in the frame of the camera: right and down by depth, shape (height, width, 2)."""
        columns = np.arange(self.width_px) - (self.width_px - 1) / 2
        rows = np.arange(self.height_px) - (self.height_px - 1) / 2
        if self.mirrored:
            columns = -columns
        x, y = np.meshgrid(columns / self.focal_px, rows / self.focal_px)
        straight = self._undistorted(np.hypot(x, y))
        return np.stack([x * straight, y * straight], axis=-1)

    def to_plane(self, height_m: float) -> Floats:
        """The homography (3, 3) from `slopes` to world x and y on the horizontal plane at `height_m`."""
        x, y, z = self.rotation.T
        drop = height_m - self.position_m[2]
        return np.stack([self.position_m[0] * z + drop * x, self.position_m[1] * z + drop * y, z])

    def _undistorted(self, distorted: Floats) -> Floats:
        """Factors that turn radii in the picture, in units of the focal length, into those of the ideal pinhole."""
        k1, k2 = self.radial
        if k1 == k2 == 0:
            return np.ones_like(distorted)
        radius = distorted.copy()
        for _ in range(8):  # Newton's method; the start is close for any lens that is not a fisheye
            excess = radius * (1 + k1 * radius**2 + k2 * radius**4) - distorted
            radius -= excess / (1 + 3 * k1 * radius**2 + 5 * k2 * radius**4)
        return np.divide(radius, distorted, out=np.ones_like(radius), where=distorted > 0)


def overhead(span_m: float = 4.6, height_m: float = 5.0, width_px: int = 704, height_px: int = 704) -> Optics:
    """A camera straight above the origin, at `height_m`, that sees `span_m` of floor along its shorter side."""
    focal_px = min(width_px, height_px) * height_m / span_m
    return Optics(
        position_m=(0.0, 0.0, height_m),
        target_m=(0.0, 0.0, 0.0),
        focal_px=focal_px,
        width_px=width_px,
        height_px=height_px,
    )
