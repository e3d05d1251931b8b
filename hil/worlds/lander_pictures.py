"""Pictures of the Lunar Lander world, drawn in software like Gymnasium's own renderer or by that renderer itself."""

import os
from collections.abc import Iterator
from itertools import pairwise

import cv2
import numpy as np
from gymnasium.envs.box2d import lunar_lander
from numpy.typing import NDArray

from hil.worlds.lander_states import FADING_PER_PICTURE, TERRAIN_POINTS, parts_of
from hil.worlds.world import Shot
from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.installing import install_command

WIDTH_PX, HEIGHT_PX = lunar_lander.VIEWPORT_W, lunar_lander.VIEWPORT_H
PX_PER_M = lunar_lander.SCALE

HULL_M = np.array(lunar_lander.LANDER_POLY) / PX_PER_M
LEG_M = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (lunar_lander.LEG_W, lunar_lander.LEG_H) / PX_PER_M
SHAPES_M = (HULL_M, LEG_M, LEG_M)

FILL_BGR = (230, 102, 128)
EDGE_BGR = (128, 77, 77)
WHITE = (255, 255, 255)
FLAG_BGR = (0, 204, 204)

# Sixteenths of a pixel, which is as fine as OpenCV's smooth lines see.
_SHIFT = 4
# What pygame draws as a circle of radius 2, with its centre at the third column and the second row from the top.
_SPECK = np.array([(0, 1, 1, 0), (1, 1, 1, 1), (1, 1, 1, 1), (0, 1, 1, 0)], dtype=bool)


def drawn(shot: Shot) -> Iterator[Frame]:
    """Gymnasium's picture of each state in software: sky, moon, flags, lander and the flames of its engines."""
    background = _background(shot.states[0, :TERRAIN_POINTS])
    for time_s, state in zip(shot.times_s, shot.states, strict=True):
        image = background.copy()
        bodies, flames = parts_of(state)
        for x_m, y_m, life in flames:
            _draw_speck(image, x_m, y_m, life)
        for shape_m, (x_m, y_m, angle_rad) in zip(SHAPES_M, bodies, strict=True):
            _draw_polygon(image, shape_m, x_m, y_m, angle_rad)
        _draw_flags(image)
        yield Frame(float(time_s), image)


def rendered(shot: Shot) -> Iterator[Frame]:
    """Each state drawn by Gymnasium itself on a surface in memory; raises MtmError when pygame is missing."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    try:
        import pygame  # noqa: F401
    except ImportError as error:
        raise MtmError(
            "Gymnasium draws the Lunar Lander with pygame, which is missing; install it with: "
            f"{install_command('worlds')}"
        ) from error
    return _rendered(shot)


def _rendered(shot: Shot) -> Iterator[Frame]:
    environment = lunar_lander.LunarLander(render_mode="rgb_array", continuous=True)
    environment.reset(seed=0)
    for time_s, state in zip(shot.times_s, shot.states, strict=True):
        _pose(environment, state)
        image = np.asarray(environment.render())[..., ::-1]  # type: ignore[no-untyped-call]
        yield Frame(float(time_s), np.ascontiguousarray(image))


def _pose(environment: lunar_lander.LunarLander, state: Floats) -> None:
    """Put terrain, lander and flames where the state has them; drawing takes a picture's fading off the flames."""
    width_m, height_m = WIDTH_PX / PX_PER_M, HEIGHT_PX / PX_PER_M
    points = list(zip(np.linspace(0.0, width_m, TERRAIN_POINTS).tolist(), state[:TERRAIN_POINTS].tolist(), strict=True))
    environment.sky_polys = [
        [left, right, (right[0], height_m), (left[0], height_m)] for left, right in pairwise(points)
    ]
    bodies, flames = parts_of(state)
    for body, (x_m, y_m, angle_rad) in zip(environment.drawlist, bodies.tolist(), strict=True):
        body.position, body.angle = (x_m, y_m), angle_rad
    environment._clean_particles(True)  # type: ignore[no-untyped-call]
    for x_m, y_m, life in flames.tolist():
        environment._create_particle(1.0, x_m, y_m, life + FADING_PER_PICTURE)  # type: ignore[no-untyped-call]


def _background(terrain_m: Floats) -> Image:
    image = np.full((HEIGHT_PX, WIDTH_PX, 3), 255, np.uint8)
    rim = np.column_stack([np.linspace(0.0, WIDTH_PX, TERRAIN_POINTS), HEIGHT_PX - 1 - np.floor(terrain_m * PX_PER_M)])
    sky = np.concatenate([rim, [(WIDTH_PX, 0), (0, 0)]]).astype(np.int32)
    cv2.fillPoly(image, [sky], (0, 0, 0), cv2.LINE_AA)
    return image


def _draw_polygon(image: Image, shape_m: Floats, x_m: float, y_m: float, angle_rad: float) -> None:
    """Filled between whole pixels, and outlined smoothly between parts of them, as pygame does."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    corners_px = (shape_m @ [[cos, sin], [-sin, cos]] + (x_m, y_m)) * PX_PER_M
    whole = np.trunc(corners_px).astype(np.int32)
    whole[:, 1] = HEIGHT_PX - 1 - whole[:, 1]
    cv2.fillPoly(image, [whole], FILL_BGR)
    cv2.polylines(image, [whole], True, FILL_BGR, 1, cv2.LINE_AA)
    cv2.polylines(image, [_fine(corners_px)], True, EDGE_BGR, 1, cv2.LINE_AA, _SHIFT)


def _fine(points_px: Floats) -> NDArray[np.int32]:
    upright = np.column_stack([points_px[:, 0], HEIGHT_PX - 1 - points_px[:, 1]])
    return np.round(upright * (1 << _SHIFT)).astype(np.int32)


def _draw_speck(image: Image, x_m: float, y_m: float, life: float) -> None:
    left, top = int(x_m * PX_PER_M) - 2, HEIGHT_PX - 1 - int(y_m * PX_PER_M) - 1
    if not (0 <= left <= WIDTH_PX - 4 and 0 <= top <= HEIGHT_PX - 4):
        return
    red, other = int(max(0.2, 0.15 + life) * 255), int(max(0.2, 0.5 * life) * 255)
    image[top : top + 4, left : left + 4][_SPECK] = (other, other, red)


def _draw_flags(image: Image) -> None:
    foot_px = int(HEIGHT_PX / 4)
    for x_px in (int(0.4 * WIDTH_PX), int(0.6 * WIDTH_PX)):
        top = HEIGHT_PX - 1 - foot_px - 50
        cv2.line(image, (x_px, top + 50), (x_px, top), WHITE)
        cv2.fillPoly(image, [np.array([(x_px, top), (x_px, top + 10), (x_px + 25, top + 5)], np.int32)], FLAG_BGR)
