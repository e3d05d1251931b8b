"""Pictures of Football as VMAS's viewer draws it: pitch, nets, ball, opponents in red, the team with its numbers.

The three of the team are cyan, magenta and yellow, so that they can be told apart. Areas have hard edges (a pixel is
filled when its centre is inside); their borders, half as bright and half transparent, and all lines are smooth. The
numbers stand at whole pixels, their lower left corners on the agents' centres, and hide a little of them.
"""

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

import cv2
import numpy as np

from hil.worlds.vmas_pictures import native_image, scale_px, to_pixels
from mtm_audit.model.picture import Image
from mtm_audit.model.track import Bools, Floats

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

PICTURE_PX = (1200, 800)
TEAM_BGR = ((255, 255, 0), (255, 0, 255), (0, 255, 255))

# VMAS's viewer applies its zoom of 1.2 twice.
_ZOOM = 1.2**2
_SCALE_PX = scale_px(PICTURE_PX, _ZOOM)
_GREEN_BGR, _WHITE_BGR, _BLACK_BGR = (64, 191, 64), (191, 191, 191), (38, 38, 38)
_RED_BGR = (28, 26, 227)
_AGENT_M, _BALL_M = 0.025, 0.02
_LENGTH_M, _WIDTH_M, _GOAL_M, _DEPTH_M = 3.0, 1.5, 0.35, 0.1
_BODIES = (*((bgr, _AGENT_M) for bgr in TEAM_BGR), *[(_RED_BGR, _AGENT_M)] * 3, (_BLACK_BGR, _BALL_M))
_SHIFT = 8
# A polygon of 30 corners is as large as a circle of this part of its radius.
_ROUND = 0.9963
_NUMBER_PX = (14, 20)


def draw(states: Floats) -> Iterator[Image]:
    """A picture for each state (n, 14): x and y in metres of the team's three, of the opponents' three, of the ball."""
    centres_px = to_pixels(states.reshape(len(states), -1, 2), PICTURE_PX, _ZOOM)
    for own_px in centres_px:
        image = _background().copy()
        for centre_px, (bgr, radius_m) in zip(own_px, _BODIES, strict=True):
            _disc(image, centre_px, _ROUND * radius_m * _SCALE_PX, bgr)
        for number, centre_px in enumerate(own_px[:3]):
            _put_number(image, number, centre_px)
        yield image


def draw_natively(env: "Environment", states: Floats) -> Iterator[Image]:
    """The same by VMAS's viewer; raises MtmError when there is neither EGL nor a display for it."""
    import torch

    scenario = env.scenario
    for agent, (blue, green, red) in zip(scenario.blue_agents, TEAM_BGR, strict=True):
        agent.color = (red / 255, green / 255, blue / 255)
    bodies = [*scenario.blue_agents, *scenario.red_agents, scenario.ball]
    for state in states:
        for body, position_m in zip(bodies, state.reshape(-1, 2), strict=True):
            body.set_pos(torch.tensor(position_m[None], dtype=torch.float32), batch_index=None)
        yield native_image(env)


@cache
def _background() -> Image:
    width_px, height_px = PICTURE_PX
    image = np.full((height_px, width_px, 3), 255, dtype=np.uint8)
    end_m, side_m = _LENGTH_M / 2, _WIDTH_M / 2
    _box(image, (-end_m, -side_m), (end_m, side_m), _GREEN_BGR, 1.0)
    centre_px = to_pixels(np.zeros(2), PICTURE_PX, _ZOOM)
    _disc(image, centre_px, _ROUND * _GOAL_M / 2 * _SCALE_PX, _WHITE_BGR)
    _disc(image, centre_px, _ROUND * (_GOAL_M / 2 - 0.02) * _SCALE_PX, _GREEN_BGR)
    inner_m, top_m = end_m - _AGENT_M, side_m - _AGENT_M
    _line(image, (0, -top_m), (0, top_m))
    for x_m in (-inner_m, inner_m):
        _line(image, (x_m, -top_m), (x_m, top_m))
    for y_m in (-top_m, top_m):
        _line(image, (-inner_m, y_m), (inner_m, y_m))
    half_m, mouth_m = _GOAL_M / 2, end_m - _AGENT_M / 2 + _DEPTH_M / 2
    back_m = end_m + _DEPTH_M - _AGENT_M
    for sign in (-1, 1):
        for y_m in (-half_m, half_m):
            _line(image, (sign * end_m, y_m), (sign * end_m, np.sign(y_m) * (side_m - _AGENT_M / 2)))
            _line(image, (sign * (back_m - _DEPTH_M), y_m), (sign * back_m, y_m))
        _line(image, (sign * back_m, -half_m), (sign * back_m, half_m))
        low_m, high_m = sorted((sign * (mouth_m - _DEPTH_M / 2), sign * (mouth_m + _DEPTH_M / 2)))
        _box(image, (low_m, -half_m), (high_m, half_m), (128, 128, 128), 0.5)
    return image


def _disc(image: Image, centre_px: Floats, radius_px: float, bgr: tuple[int, int, int]) -> None:
    """A round area and its border, in place; the bodies cannot leave the picture."""
    left, top = (np.floor(centre_px - radius_px) - 1).astype(int)
    size = int(np.ceil(2 * radius_px)) + 4
    columns, rows = np.arange(left, left + size) - centre_px[0], np.arange(top, top + size) - centre_px[1]
    beyond_px = np.sqrt(rows[:, None] ** 2 + columns**2) - radius_px
    colour = np.array(bgr, dtype=np.float64)
    window = image[top : top + size, left : left + size]
    filled = np.where((beyond_px <= 0.0)[..., None], colour, window)
    border = (0.5 * np.clip(1.5 - np.abs(beyond_px), 0.0, 1.0))[..., None]
    window[:] = np.rint(filled + border * (0.5 * colour - filled))


def _put_number(image: Image, number: int, centre_px: Floats) -> None:
    width, height = _NUMBER_PX
    left, bottom = int(centre_px[0]), int(centre_px[1])
    image[bottom - height : bottom, left : left + width][_number(number)] = 0


@cache
def _number(number: int) -> Bools:
    """Where the number of an agent, counted from 1, is black."""
    width, height = _NUMBER_PX
    stencil = np.zeros((height, width), dtype=np.uint8)
    cv2.putText(stencil, str(number + 1), (1, height - 3), cv2.FONT_HERSHEY_SIMPLEX, 0.65, 255, 1, cv2.LINE_8)
    return np.asarray(stencil > 0)


def _box(
    image: Image, low_m: tuple[float, float], high_m: tuple[float, float], bgr: tuple[int, int, int], alpha: float
) -> None:
    left, bottom = np.rint(to_pixels(np.array(low_m), PICTURE_PX, _ZOOM)).astype(int)
    right, top = np.rint(to_pixels(np.array(high_m), PICTURE_PX, _ZOOM)).astype(int)
    window = image[top : bottom + 1, left : right + 1]
    window[:] = np.rint((1.0 - alpha) * window + alpha * np.array(bgr))
    cv2.rectangle(image, (int(left), int(top)), (int(right), int(bottom)), tuple(0.75 * value for value in bgr), 1)


def _line(image: Image, start_m: tuple[float, float], end_m: tuple[float, float]) -> None:
    start, end = (_fixed(to_pixels(np.array(point_m), PICTURE_PX, _ZOOM)) for point_m in (start_m, end_m))
    cv2.line(image, start, end, _WHITE_BGR, 1, cv2.LINE_AA, _SHIFT)


def _fixed(point_px: Floats) -> tuple[int, int]:
    """OpenCV's fixed-point coordinates."""
    column, row = np.rint(point_px * 2**_SHIFT).astype(int)
    return int(column), int(row)
