"""The frame whose axes a robot's noise moves along: the world's, or the robot's own.

A robot is commanded along its own axes, and when it turns, so does the direction in which its noise shows. Where its
heading is known the motion can be turned back; a robot that cannot move sideways shows its heading by its path.
"""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.track import Floats

Complexes = NDArray[np.complex128]
ReferenceFrame = Literal["world", "body", "path"]
REFERENCE_FRAMES: tuple[ReferenceFrame, ...] = get_args(ReferenceFrame)
BODY_AXES = ("forward", "lateral")
YAW_AXES = ("yaw",)
_PLANE = ("x", "y")

# Directions of a path come from motion over so long; shorter ones are noise of the tracker.
_PATH_S = 0.2
# A mean resultant of headings above this is a robot that holds its heading, within some 15 degrees.
_STEADY = 0.966


def known_frames(glimpse: Glimpse) -> tuple[ReferenceFrame, ...]:
    """The frames in which the motion can be told apart: the world's own alone when the robot holds its heading."""
    if glimpse.axes != _PLANE:
        return ("world",)
    if glimpse.headings_rad is None:
        return ("world", "path")
    return ("world",) if _holds_heading(glimpse.headings_rad) else ("world", "body")


def shows_heading(glimpse: Glimpse) -> bool:
    """Whether the body moves in the plane and its heading was recorded."""
    return glimpse.axes == _PLANE and glimpse.headings_rad is not None


def _holds_heading(headings_rad: Floats) -> bool:
    return bool(np.abs(np.mean(np.exp(1j * headings_rad))) > _STEADY)


def along_own_axes(glimpse: Glimpse, frame: ReferenceFrame) -> Glimpse:
    """Forward and lateral velocities by the heading of the frame; the glimpse itself in the world's frame, or where it
    has no heading.
    """
    headings_rad = _headings(glimpse, frame)
    if frame == "world" or headings_rad is None:
        return glimpse
    middle_rad = 0.5 * (headings_rad[1:] + headings_rad[:-1])
    cosine, sine = np.cos(middle_rad), np.sin(middle_rad)
    x, y = glimpse.velocities.T
    turned = np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=1)
    return replace(glimpse, velocities=turned, axes=BODY_AXES)


def turning(glimpse: Glimpse, frame: ReferenceFrame) -> Glimpse | None:
    """The yaw rate as the one velocity of a glimpse, None where no heading is known."""
    headings_rad = _headings(glimpse, frame)
    if headings_rad is None:
        return None
    rates_radps = np.diff(headings_rad) / glimpse.durations_s
    return replace(glimpse, velocities=rates_radps[:, None], axes=YAW_AXES)


def _headings(glimpse: Glimpse, frame: ReferenceFrame) -> Floats | None:
    if glimpse.axes != _PLANE:
        return None
    return headings_along_path(glimpse) if frame == "path" else glimpse.headings_rad


def headings_along_path(glimpse: Glimpse) -> Floats:
    """Headings (n + 1,) of a body that moves forward or backward only, up to half a turn, which nothing shows.

    Squared as complex numbers, velocities do not say which end leads, and slow ones, whose direction is noise, count
    little in the mean over `_PATH_S`.
    """
    moved = glimpse.displacements @ np.array([1.0, 1j])
    half_s = 0.5 * _PATH_S
    before, after = (_interpolated(glimpse.edges_s + shift_s, glimpse.edges_s, moved) for shift_s in (-half_s, half_s))
    headings_rad: Floats = np.unwrap(np.angle((after - before) ** 2)) / 2.0
    return headings_rad


def _interpolated(wanted_s: Floats, times_s: Floats, values: Complexes) -> Complexes:
    return np.asarray(np.interp(wanted_s, times_s, values.real) + 1j * np.interp(wanted_s, times_s, values.imag))
