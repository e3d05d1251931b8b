"""What pictures of VMAS's worlds have in common: its viewer's geometry, and its own renderer without a screen."""

from typing import TYPE_CHECKING

import numpy as np

from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import MtmError

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment


def scale_px(picture_px: tuple[int, int], zoom: float) -> float:
    """Pixels per metre of VMAS's viewer: the shorter side of the picture shows 2 `zoom` metres."""
    return min(picture_px) / (2.0 * zoom)


def to_pixels(points_m: Floats, picture_px: tuple[int, int], zoom: float) -> Floats:
    """Column and row (..., 2) of points (..., 2) in metres, y up, the world's origin being at the picture's centre.

    Whole numbers are centres of pixels, as in OpenCV; OpenGL's are at their lower left corners.
    """
    width, height = picture_px
    offsets_px: Floats = scale_px(picture_px, zoom) * points_m * np.array([1.0, -1.0])
    return np.asarray(offsets_px + np.array([width / 2 - 0.5, height / 2 - 0.5]))


def native_image(env: "Environment") -> Image:
    """The first world of a batch as VMAS's renderer draws it, as it stands: blue, green, red.

    Raises MtmError when there is neither EGL nor a display for it.
    """
    # Pyglet states what is missing by half a dozen unrelated exceptions, some of them bare.
    try:
        rgb = env.render(mode="rgb_array", env_index=0)
    except Exception as error:
        raise MtmError(
            "VMAS's renderer finds no graphics here; install libegl1 and libgl1-mesa-dri, or start a display with Xvfb"
        ) from error
    return np.ascontiguousarray(rgb[..., ::-1])
