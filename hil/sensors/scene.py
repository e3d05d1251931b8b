"""Drawing the arena and its robots as one camera sees them at one instant."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from hil.sensors import textures
from hil.sensors.optics import Optics
from hil.sensors.poses import Floats
from mtm_audit.model.picture import Image

SUPERSAMPLING = 3
FLOOR_SOFTENED = 0.8  # texels
CORNERS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
Maps = NDArray[np.float32]


@dataclass(frozen=True)
class Scene:
    """An arena of `arena_m` (length along x, width along y) centred on the origin.

    Every robot carries the ArUco marker of its number in the list of trajectories, or, with `colours_bgr`, a plain
    square of its own colour. `floor` says what lies on it: a mat of faint grain, or a carpet; on it lie the
    `floor_markers`, each a number with x and y of its middle in metres.
    """

    arena_m: tuple[float, float] = (4.5, 4.5)
    colours_bgr: tuple[tuple[int, int, int], ...] | None = None
    floor: textures.FloorKind = "mat"
    floor_markers: tuple[tuple[int, float, float], ...] = ()

    def top(self, number: int) -> Image:
        """Premultiplied BGRA picture of robot `number` from above."""
        if self.colours_bgr is None:
            hard = textures.marker_top(number)
        else:
            hard = textures.coloured_top(self.colours_bgr[number % len(self.colours_bgr)])
        # Edges as wide as the samples lie apart keep an edge along a pixel row from moving in steps.
        return np.asarray(cv2.GaussianBlur(hard, (0, 0), 1.3), dtype=np.uint8)


@dataclass(frozen=True)
class Sighting:
    """One robot during one exposure: `poses` (k, 3), x and y in metres and heading, averaged with equal weight."""

    top: Image
    poses: Floats


class Painter:
    """Draws sightings over a background that is drawn once; holds the maps from pixels to the planes of the world.

    Tops are warped through the camera's exact projection, at several times the resolution, and then averaged, so that
    they lie where the geometry puts them to about a hundredth of a pixel.
    """

    def __init__(self, scene: Scene, optics: Optics, blur_px: float = 0.0) -> None:
        self._optics = optics
        self._blur_px = blur_px
        self._top_xy = _finite(optics.plane_xy_m(textures.ROBOT_HEIGHT_M))
        self._floor_xy = _finite(optics.plane_xy_m(0.0))
        self._shadow = textures.shadow()
        self._floor = textures.floor(*scene.arena_m, kind=scene.floor, markers=scene.floor_markers)
        self._background = self._draw_background(self._floor, samples=2)
        self._slopes: Maps | None = None

    def aim(self, optics: Optics) -> None:
        """Look through other optics from now on, which have the same lens and size."""
        if self._slopes is None:
            self._slopes = optics.slopes().astype(np.float32)
            # Softened by half a pixel or so, the floor is drawn with one sample a pixel: a new one for every picture.
            self._floor = np.asarray(cv2.GaussianBlur(self._floor, (0, 0), FLOOR_SOFTENED), dtype=np.uint8)
        self._optics = optics
        self._top_xy = _plane_xy_m(self._slopes, optics, textures.ROBOT_HEIGHT_M)
        self._floor_xy = _plane_xy_m(self._slopes, optics, 0.0)
        self._background = self._draw_background(self._floor, samples=1)

    def paint(self, sightings: Sequence[Sighting]) -> Image:
        """The picture (height, width, 3), blue green red; robots nearer to the camera hide those behind them."""
        picture: Image = self._background.copy()
        camera = np.asarray(self._optics.position_m)[:2]
        for sighting in sorted(sightings, key=lambda one: -float(np.hypot(*(one.poses[0, :2] - camera)))):
            region = self._region(sighting.poses)
            if region is not None:
                self._draw_shadow(picture, region, sighting.poses)
                under = picture[region].astype(np.float32)
                layers = [self._draw_robot(under, region, sighting.top, pose) for pose in sighting.poses]
                picture[region] = np.clip(np.mean(layers, axis=0) + 0.5, 0, 255)
        return picture

    def _draw_background(self, texture: Image, samples: int) -> Image:
        maps = _texel_maps(self._floor_xy, np.zeros(3), texture.shape, textures.FLOOR_TEXELS_PER_M)
        floor = _supersampled(texture, maps, samples, textures.SURROUND_BGR).astype(np.float32)
        floor *= _vignette(floor.shape[:2])[:, :, None]
        if self._blur_px > 0:
            floor = np.asarray(cv2.GaussianBlur(floor, (0, 0), self._blur_px), dtype=np.float32)
        return np.asarray(np.clip(floor + 0.5, 0, 255), dtype=np.uint8)

    def _region(self, poses: Floats) -> tuple[slice, slice] | None:
        """Rows and columns that the robot touches in any of the poses; None when it is outside of the picture."""
        cos, sin = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        along, across = (CORNERS * textures.TOP_SPAN_M / 2).T
        ground = np.stack([cos * along - sin * across, sin * along + cos * across], axis=-1) + poses[:, None, :2]
        corners = np.concatenate([_at_height(ground.reshape(-1, 2), z) for z in (0.0, textures.ROBOT_HEIGHT_M)])
        if np.any((corners - np.asarray(self._optics.position_m)) @ self._optics.rotation[2] < 0.05):
            return None
        pixels = self._optics.project(corners)
        return self._clipped(pixels.min(axis=0) - 2 - 3 * self._blur_px, pixels.max(axis=0) + 3 + 3 * self._blur_px)

    def _clipped(self, low: Floats, high: Floats) -> tuple[slice, slice] | None:
        """Rows and columns between two points (column, row), inside the picture; None when less than two are left."""
        size = self._optics.width_px, self._optics.height_px
        first, last = np.clip(low, 0, size).astype(int), np.clip(high, 0, size).astype(int)
        return None if np.any(last - first < 2) else (slice(first[1], last[1]), slice(first[0], last[0]))

    def _draw_shadow(self, picture: Image, region: tuple[slice, slice], poses: Floats) -> None:
        """Darken the floor around the robot, in place.

        A shadow is soft, so the middle of the exposure and every fourth pixel stand for all of them.
        """
        low, high = (np.array([getattr(part, end) for part in region[::-1]]) for end in ("start", "stop"))
        wide = self._clipped(low - 0.4 * (high - low).max(), high + 0.4 * (high - low).max())
        if wide is not None:
            rows, columns = wide
            coarse = self._floor_xy[rows.start : rows.stop : 4, columns.start : columns.stop : 4]
            maps = _texel_maps(coarse, poses[len(poses) // 2], self._shadow.shape, textures.TEXELS_PER_M)
            dark = cv2.remap(self._shadow, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR)
            light = 1 - cv2.resize(dark, (columns.stop - columns.start, rows.stop - rows.start))
            picture[wide] = cv2.multiply(picture[wide], cv2.cvtColor(light, cv2.COLOR_GRAY2BGR), dtype=cv2.CV_8U)

    def _draw_robot(
        self, under: NDArray[np.float32], region: tuple[slice, slice], top: Image, pose: Floats
    ) -> NDArray[np.float32]:
        maps = _texel_maps(self._top_xy[region], pose, top.shape, textures.TEXELS_PER_M)
        plate = _supersampled(top, maps, SUPERSAMPLING).astype(np.float32)
        layer = plate + self._draw_sides(region, pose) * (1 - plate[:, :, 3:] / 255)
        if self._blur_px > 0:
            layer = np.asarray(cv2.GaussianBlur(layer, (0, 0), self._blur_px), dtype=np.float32)
        return np.asarray(layer[:, :, :3] + under * (1 - layer[:, :, 3:] / 255), dtype=np.float32)

    def _draw_sides(self, region: tuple[slice, slice], pose: Floats) -> NDArray[np.float32]:
        """Premultiplied BGRA of the body below the top: the outline of its box."""
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        half = np.array([textures.ROBOT_LENGTH_M, textures.ROBOT_WIDTH_M]) / 2
        corners = (half * CORNERS) @ np.array([[cos, sin], [-sin, cos]])
        points = np.concatenate([_at_height(corners + pose[:2], z) for z in (0.03, textures.ROBOT_HEIGHT_M)])
        pixels = self._optics.project(points) - [region[1].start, region[0].start]
        outline = cv2.convexHull(np.round(pixels * 16).astype(np.int32))
        sides = np.zeros((region[0].stop - region[0].start, region[1].stop - region[1].start, 4), np.uint8)
        cv2.fillConvexPoly(sides, outline, (34, 30, 28, 255), cv2.LINE_AA, 4)
        return sides.astype(np.float32)


def _finite(plane_xy_m: Floats | Maps) -> Maps:
    """Pixels that look past the plane see a point far outside of everything."""
    return np.nan_to_num(plane_xy_m, nan=1e4).clip(-1e4, 1e4).astype(np.float32)


def _plane_xy_m(slopes: Maps, optics: Optics, height_m: float) -> Maps:
    """World x and y of what every pixel sees of a horizontal plane; far outside where it looks past it."""
    plane = optics.to_plane(height_m)
    xy_m = np.asarray(cv2.perspectiveTransform(slopes, plane), dtype=np.float32)
    depth = slopes @ plane[2, :2].astype(np.float32) + np.float32(plane[2, 2])
    xy_m[depth * np.float32(height_m - optics.position_m[2]) <= 0] = 1e4
    return _finite(xy_m)


def _at_height(points_xy_m: Floats, height_m: float) -> Floats:
    return np.column_stack([points_xy_m, np.full(len(points_xy_m), height_m)])


def _texel_maps(plane_xy_m: Maps, pose: Floats, shape: tuple[int, ...], texels_per_m: int) -> Maps:
    """Columns and rows of a texture that lies at `pose`, its columns along +x of the body, for points of its plane."""
    cos, sin = texels_per_m * np.cos(pose[2]), texels_per_m * np.sin(pose[2])
    turn = np.array([[cos, sin, 0.0], [sin, -cos, 0.0]])
    turn[:, 2] = [(shape[1] - 1) / 2, (shape[0] - 1) / 2] - turn[:, :2] @ pose[:2]
    return np.asarray(cv2.transform(plane_xy_m, turn), dtype=np.float32)


def _supersampled(texture: Image, maps: Maps, samples: int, beyond: tuple[int, ...] = (0, 0, 0, 0)) -> Image:
    """The texture seen through `maps`, each pixel the mean of `samples` squared; smooth maps may be enlarged."""
    rows, columns = maps.shape[:2]
    if samples == 1:
        plain = cv2.remap(texture, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=beyond)
        return np.asarray(plain, dtype=np.uint8)
    fine = cv2.resize(maps, (columns * samples, rows * samples), interpolation=cv2.INTER_LINEAR)
    warped = cv2.remap(texture, fine[..., 0], fine[..., 1], cv2.INTER_LINEAR, borderValue=beyond)
    return np.asarray(cv2.resize(warped, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8)


@cache
def _vignette(shape: tuple[int, int]) -> NDArray[np.float32]:
    rows, columns = (np.linspace(-1, 1, count, dtype=np.float32) for count in shape)
    return np.asarray(1.04 - 0.12 * (rows[:, None] ** 2 + columns**2) / 2 - 0.04 * columns, dtype=np.float32)
