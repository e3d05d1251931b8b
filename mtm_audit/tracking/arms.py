"""Tracking a jointed arm of two links by their colours, as the paper does for Reacher."""

from collections.abc import Iterable
from typing import Literal

import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.armpose import Stations, joint_angles
from mtm_audit.tracking.cover import cover_of, split_colours
from mtm_audit.tracking.gather import Progress, steady
from mtm_audit.tracking.links import STATIONS, Box, Link, see_link, widened
from mtm_onboard.protocol.errors import MtmError

# Colours that stay apart in hue from each other, from red targets, pink walls and teal fingertips.
INNER_RGB = (0, 102, 255)
OUTER_RGB = (230, 200, 0)
INNER_COLOUR, OUTER_COLOUR = (f"#{bytes(rgb).hex()}" for rgb in (INNER_RGB, OUTER_RGB))

TRACK_NAME = "arm"
MARGIN_PX = 24  # farther than a link moves between two frames


def parse_arms(text: str) -> "ArmTracker":
    """The tracker for `INNER,OUTER`, two colours, or for the usual ones; raises MtmError for anything else."""
    colours = split_colours(text) if text else (INNER_COLOUR, OUTER_COLOUR)
    if len(colours) != 2:
        raise MtmError(
            f"{text!r} does not name the colours of two links; write the inner one and the outer one, such as "
            "arms:#0066ff,#e6c800"
        )
    return ArmTracker(*colours)


class ArmTracker:
    """Follows an arm of two straight links, each of its own colour, that turns about a point fixed in the picture.

    `inner` and `outer` are colours as `colour:` takes them; `base_px` is the column and row of the point about which
    the inner link turns, found from its turning when None. The paper smooths the links' middles with its Kalman
    filter; `smooth` False leaves that out. The outer link's direction is counted from the inner one, as its joint
    turns it, or like the inner one's when `relative` is False.
    """

    pixels: Literal["gray", "bgr"] = "bgr"

    def __init__(
        self,
        inner: str = INNER_COLOUR,
        outer: str = OUTER_COLOUR,
        base_px: tuple[float, float] | None = None,
        *,
        smooth: bool = True,
        relative: bool = True,
    ) -> None:
        self._names = (inner, outer)
        self._covers = (cover_of(inner), cover_of(outer))
        self._base_px, self._smooth, self._relative = base_px, smooth, relative

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames` of blue, green and red: one track, `arm`, axes `inner` and `outer` in radians.

        `inner` is the direction of the inner link from the base on, counter-clockwise from the picture's right;
        `outer` that of the outer link from the inner one on (see `relative`); both run on beyond a turn. A frame in
        which too little of a link shows is not valid. Raises MtmError when no frame shows the arm or the picture
        changes its size.
        """
        times_s: list[float] = []
        height_px = 0
        seen: tuple[list[Link | None], list[Link | None]] = ([], [])
        steps_px: list[float | None] = [None, None]
        windows: list[Box | None] = [None, None]
        for frame in steady(frames, progress):
            times_s.append(frame.time_s)
            height_px = frame.size[1]
            for number, cover in enumerate(self._covers):
                window = windows[number] or (0, 0, *frame.size)
                found = see_link(frame.image, cover, window, steps_px[number])
                link, steps_px[number] = found or (None, steps_px[number])
                windows[number] = None if link is None else widened(link.box, MARGIN_PX, frame.size)
                seen[number].append(link)
        for name, place, history in zip(self._names, ("inner", "outer"), seen, strict=True):
            if not any(history):
                raise MtmError(
                    f"{name}, the colour of the {place} link, is not found in {len(times_s)} frames; give the colours "
                    "that the links have in the picture, as in arms:#0066ff,#e6c800"
                )
        inner, outer = (_stations(history, height_px) for history in seen)
        base = None if self._base_px is None else np.array([self._base_px[0], height_px - 1 - self._base_px[1]])
        angles = joint_angles(np.array(times_s), inner, outer, base, smooth=self._smooth)
        if not self._relative:
            angles = np.cumsum(angles, axis=1)
        valid = np.asarray(np.isfinite(angles[:, 0]))
        if not valid.any():
            raise MtmError(
                f"none of {len(times_s)} frames shows both links of the arm; film it from above its plane with both "
                "links in view"
            )
        return [Track(TRACK_NAME, np.array(times_s), angles, valid, axes=("inner", "outer"), unit="rad")]


def _stations(links: list[Link | None], height_px: int) -> Stations:
    """All frames' stations, in pixels with y up."""
    points: Floats = np.full((len(links), STATIONS, 2), np.nan)
    widths: Floats = np.zeros((len(links), STATIONS))
    for row, link in enumerate(links):
        if link is not None:
            points[row], widths[row] = link.stations, link.widths_px
    points[..., 1] = height_px - 1 - points[..., 1]
    return Stations(points, widths)
