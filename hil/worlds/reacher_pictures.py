"""Pictures of the Reacher from straight above: by a software camera, and by MuJoCo's own renderer.

Both show Gymnasium's model as MuJoCo draws it, four samples a pixel, but for the hues of the two links: in the
model both are the same blue, and the paper tells the inner arm from the outer one by hue.
"""

import os
from collections.abc import Iterator
from functools import lru_cache
from importlib import import_module

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from hil.worlds.world import Shot
from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats
from mtm_audit.tracking.arms import INNER_RGB, OUTER_RGB
from mtm_onboard.protocol.errors import MtmError

PICTURE_PX = 480
# The camera is as high as it takes to see the whole arena; MuJoCo's own field of view.
CAMERA_M = 0.83
FIELD_OF_VIEW_DEG = 45.0

# The model file's measures and colours.
LINK_M = 0.1
LINK_RADIUS_M = 0.01
FINGERTIP_M = 0.11
TARGET_RADIUS_M = 0.009
ROOT_RADIUS_M = 0.011
WALL_M, WALL_RADIUS_M = 0.3, 0.02
AXIS_HEIGHT_M = 0.01
FINGERTIP_RGB = (0, 204, 153)
TARGET_RGB = (230, 51, 51)
PINK_RGB = (230, 102, 153)
GROUND_RGB = (230, 230, 230)

# Twice as many samples as pixels in either direction; the links are kept ready at eight times as many.
_SAMPLES = 2
_FINE = 8
_FOCAL_PX = PICTURE_PX / 2 / np.tan(np.radians(FIELD_OF_VIEW_DEG) / 2)
_PX_PER_M = _FOCAL_PX / (CAMERA_M - AXIS_HEIGHT_M)
_CENTRE = (PICTURE_PX * _SAMPLES - 1) / 2
_MARGIN_M = 0.002
# The fourth channel of a layer is the height above ground, in these steps.
_HEIGHT_STEP_M = 0.0001

Box = tuple[slice, slice]


def drawn_pictures(shot: Shot) -> Iterator[Frame]:
    """The shot as MuJoCo would show it, drawn in software."""
    inner, outer = _link(INNER_RGB, with_fingertip=False), _link(OUTER_RGB, with_fingertip=True)
    for time_s, (inner_rad, bend_rad, target_x_m, target_y_m) in zip(shot.times_s, shot.states, strict=True):
        samples, pixels = _scene(float(target_x_m), float(target_y_m))
        elbow_m = LINK_M * np.array([np.cos(inner_rad), np.sin(inner_rad)])
        outer_rad = inner_rad + bend_rad
        tip_m = elbow_m + FINGERTIP_M * np.array([np.cos(outer_rad), np.sin(outer_rad)])
        region = _box(np.stack([np.zeros(2), elbow_m, tip_m]))
        canvas = samples[region].copy()
        _place(canvas, region, inner, np.zeros(2), inner_rad, _box(np.stack([np.zeros(2), elbow_m])))
        _place(canvas, region, outer, elbow_m, outer_rad, _box(np.stack([elbow_m, tip_m])))
        image = pixels.copy()
        rows, columns = (slice(side.start // _SAMPLES, side.stop // _SAMPLES) for side in region)
        image[rows, columns] = _averaged(canvas)
        yield Frame(float(time_s), image)


def rendered_pictures(model: mujoco.MjModel, shot: Shot) -> Iterator[Frame]:
    """The shot drawn by MuJoCo with OpenGL: MUJOCO_GL chooses egl (the default), osmesa or glfw.

    Raises MtmError when there is no OpenGL.
    """
    for name, rgb in (("link0", INNER_RGB), ("link1", OUTER_RGB)):
        model.geom(name).rgba[:3] = np.divide(rgb, 255)
    backend = os.environ.get("MUJOCO_GL") or "egl"
    try:
        context = import_module(f"mujoco.{backend}").GLContext(PICTURE_PX, PICTURE_PX)
        context.make_current()
        renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
    except Exception as error:
        # Without its libraries each of the bindings fails in a way of its own.
        raise MtmError(
            f"MuJoCo cannot draw with {backend} here; install OpenGL (libegl1 or libosmesa6) and set MUJOCO_GL to egl "
            "or osmesa, or use the software camera's pictures"
        ) from error
    try:
        yield from _rendered(model, renderer, shot)
    finally:
        renderer.free()
        context.free()


def _rendered(model: mujoco.MjModel, renderer: mujoco.MjrContext, shot: Shot) -> Iterator[Frame]:
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, renderer)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = 0.0, CAMERA_M, 90.0, -90.0
    scene, options, nudge = mujoco.MjvScene(model, 100), mujoco.MjvOption(), mujoco.MjvPerturb()
    view = mujoco.MjrRect(0, 0, PICTURE_PX, PICTURE_PX)
    data = mujoco.MjData(model)
    image = np.empty((PICTURE_PX, PICTURE_PX, 3), np.uint8)
    for time_s, state in zip(shot.times_s, shot.states, strict=True):
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        mujoco.mjv_updateScene(model, data, options, nudge, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
        mujoco.mjr_render(view, scene, renderer)
        mujoco.mjr_readPixels(image, None, view, renderer)
        yield Frame(float(time_s), np.ascontiguousarray(image[::-1, :, ::-1]))


def _shaded(rgb: tuple[int, int, int], slope: Floats, height_m: Floats | float, covered: NDArray[np.bool_]) -> Image:
    """A layer (blue, green, red, height) of one colour under MuJoCo's headlight; `slope` is the normal's upward part.

    Ambient light 0.1, diffuse 0.4, specular 0.5 on a surface of specular 0.5 and shininess 64.
    """
    diffuse = 0.1 + 0.4 * slope
    layer = np.zeros((*slope.shape, 4))
    layer[..., :3] = diffuse[..., None] * rgb[::-1] + 0.25 * 255 * slope[..., None] ** 64
    layer[..., 3] = height_m / _HEIGHT_STEP_M
    return np.where(covered[..., None], np.rint(layer), 0).astype(np.uint8)


def _ball(rgb: tuple[int, int, int], distance_m: Floats, radius_m: float) -> Image:
    """The layer of a sphere, or of a capsule, at distances from its centre or axis."""
    slope = np.sqrt(np.maximum(0.0, 1 - (distance_m / radius_m) ** 2))
    return _shaded(rgb, slope, AXIS_HEIGHT_M + radius_m * slope, distance_m < radius_m)


def _put_higher(canvas: Image, layer: Image) -> None:
    """Let `layer` cover `canvas` where it is higher."""
    cv2.copyTo(layer, cv2.compare(cv2.extractChannel(layer, 3), cv2.extractChannel(canvas, 3), cv2.CMP_GT), canvas)


@lru_cache(maxsize=2)
def _link(rgb: tuple[int, int, int], *, with_fingertip: bool) -> Image:
    """A link along +x on a fine grid whose sample (row, column) = (h, h) is its joint, h being half its height."""
    half = round((LINK_RADIUS_M + _MARGIN_M) * _PX_PER_M * _FINE)
    columns, rows = np.meshgrid(np.arange(round(2.4 * half + FINGERTIP_M * _PX_PER_M * _FINE)), np.arange(2 * half + 1))
    x_m, y_m = (columns - half) / (_PX_PER_M * _FINE), (rows - half) / (_PX_PER_M * _FINE)
    layer = _ball(rgb, np.hypot(x_m - np.clip(x_m, 0.0, LINK_M), y_m), LINK_RADIUS_M)
    if with_fingertip:
        _put_higher(layer, _ball(FINGERTIP_RGB, np.hypot(x_m - FINGERTIP_M, y_m), LINK_RADIUS_M))
    return layer


def _place(canvas: Image, region: Box, link: Image, joint_m: Floats, angle_rad: float, box: Box) -> None:
    """Draw a link from its joint on, at an angle, inside `box`; `canvas` is what `region` of all samples holds."""
    rows, columns = box
    joint_column = _CENTRE + _SAMPLES * _PX_PER_M * joint_m[0] - columns.start
    joint_row = _CENTRE - _SAMPLES * _PX_PER_M * joint_m[1] - rows.start
    scale, half = _FINE / _SAMPLES, link.shape[0] // 2
    along = scale * np.array([np.cos(angle_rad), -np.sin(angle_rad)])
    across = scale * np.array([-np.sin(angle_rad), -np.cos(angle_rad)])
    turn = np.stack([along, across])
    shift = half - turn @ (joint_column, joint_row)
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    size = (columns.stop - columns.start, rows.stop - rows.start)
    layer = cv2.warpAffine(link, np.column_stack([turn, shift]), size, flags=flags)
    top, left = rows.start - region[0].start, columns.start - region[1].start
    _put_higher(canvas[top : top + size[1], left : left + size[0]], np.asarray(layer, np.uint8))


def _box(points_m: Floats) -> Box:
    """Rows and columns of samples, whole pixels, that hold links between these points."""
    low = (points_m.min(axis=0) - LINK_RADIUS_M - _MARGIN_M) * _PX_PER_M + PICTURE_PX / 2
    high = (points_m.max(axis=0) + LINK_RADIUS_M + _MARGIN_M) * _PX_PER_M + PICTURE_PX / 2
    rows = slice(_SAMPLES * int(PICTURE_PX - high[1]), _SAMPLES * (int(PICTURE_PX - low[1]) + 1))
    return rows, slice(_SAMPLES * int(low[0]), _SAMPLES * (int(high[0]) + 1))


def _averaged(samples: Image) -> Image:
    size = (samples.shape[1] // _SAMPLES, samples.shape[0] // _SAMPLES)
    pixels = cv2.resize(samples, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR), np.uint8)


@lru_cache(maxsize=16)
def _scene(target_x_m: float, target_y_m: float) -> tuple[Image, Image]:
    """Everything but the arm, as samples with heights and as the picture."""
    x_m, y_m = _sampled_plane()
    samples = _arena().copy()
    _put_higher(samples, _ball(TARGET_RGB, np.hypot(x_m - target_x_m, y_m - target_y_m), TARGET_RADIUS_M))
    return samples, _averaged(samples)


@lru_cache(maxsize=1)
def _arena() -> Image:
    """Ground, walls and the root of the arm, as samples."""
    x_m, y_m = _sampled_plane()
    layer = _shaded(GROUND_RGB, np.full(x_m.shape, 0.998), 0.0, np.full(x_m.shape, True))
    # Distance from the centre across the walls, which are round at their outer corners.
    low, high = np.sort(np.abs([x_m, y_m]), axis=0)
    out_m = np.where(low > WALL_M, WALL_M + np.hypot(low - WALL_M, high - WALL_M), high)
    _put_higher(layer, _walls(out_m))
    root_m = np.hypot(x_m, y_m) * (CAMERA_M - 2 * LINK_RADIUS_M) / (CAMERA_M - AXIS_HEIGHT_M)
    _put_higher(layer, _shaded(PINK_RGB, np.full(x_m.shape, 0.998), 2 * LINK_RADIUS_M, root_m < ROOT_RADIUS_M))
    return layer


def _walls(out_m: Floats) -> Image:
    """Lying cylinders where lines of sight through points of the arm's plane, so far out, meet them."""
    drop_m = CAMERA_M - AXIS_HEIGHT_M
    # The line of sight (t out, -t drop) from the camera meets the circle around (WALL_M, -drop) of the wall's radius.
    square, half = out_m**2 + drop_m**2, out_m * WALL_M + drop_m**2
    root = half**2 - square * (WALL_M**2 + drop_m**2 - WALL_RADIUS_M**2)
    height_m = drop_m - drop_m * (half - np.sqrt(np.maximum(root, 0.0))) / square
    slope = np.clip(height_m / WALL_RADIUS_M, 0.0, 1.0)
    return _shaded(PINK_RGB, slope, 0.0254, (root > 0) & (height_m > -AXIS_HEIGHT_M))


@lru_cache(maxsize=1)
def _sampled_plane() -> tuple[Floats, Floats]:
    """Where the samples are in the plane of the arm, x and y, (rows, columns) each."""
    steps_m = (np.arange(PICTURE_PX * _SAMPLES) - _CENTRE) / (_SAMPLES * _PX_PER_M)
    x_m, y_m = np.meshgrid(steps_m, -steps_m)
    return x_m, y_m
