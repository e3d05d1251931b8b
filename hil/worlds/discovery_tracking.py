"""The paper's tracker for Discovery: the centroid of the agent's colour.

The rays of its lidar cut the agent into fifteen sectors, so that a tracker of whole patches would follow one of
them; here everything of the colour near the last place counts, each pixel by how much of the colour it shows.
"""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np

from mtm_audit.recordings.frames import Frame, Image
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_audit.tracks import Track
from mtm_onboard.protocol import MtmError

# Blue less green is 64 on the agent, nothing on white, gray and black, and negative on targets; compressed video is
# some counts off.
_NOISE_COUNTS = 8.0
_LEAST_COUNTS = 64.0 * 100
# The agent's radius, and what it goes in one tick at unit speed with noise on top.
_REACH_PX = 18 + 42


class AgentTracker:
    """Follows the one agent."""

    pixels: Literal["gray", "bgr"] = "bgr"

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """The track `agent`, in pixels with y up; raises MtmError when it is not seen or the picture changes size."""
        gather = Gather()
        place: tuple[float, float] | None = None
        for frame in steady(frames, progress):
            gather.next_frame(frame)
            place = (_centroid_near(frame.image, place) if place else None) or _centroid(frame.image)
            if place is not None:
                gather.put("agent", *place)
        if not gather.seen:
            raise MtmError(f"the agent is in none of {len(gather.times_s)} frames; check that they show Discovery")
        return gather.tracks(with_headings=False)


def _centroid_near(image: Image, place: tuple[float, float]) -> tuple[float, float] | None:
    left, top = (max(round(coordinate) - _REACH_PX, 0) for coordinate in place)
    found = _centroid(image[top : round(place[1]) + _REACH_PX + 1, left : round(place[0]) + _REACH_PX + 1])
    return (left + found[0], top + found[1]) if found else None


def _centroid(image: Image) -> tuple[float, float] | None:
    """Column and row of the colour's centroid; None where there is too little of it."""
    blue_less_green = cv2.transform(image.astype(np.float32), np.array([[1.0, -1.0, 0.0]]))
    moments = cv2.moments(np.maximum(blue_less_green - _NOISE_COUNTS, 0.0))
    if moments["m00"] < _LEAST_COUNTS:
        return None
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
