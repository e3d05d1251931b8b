"""Tracking by the centroid of a colour: all of it that is near the last place, in however many pieces."""

from collections.abc import Iterable
from typing import Literal

import cv2

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Track
from mtm_audit.tracking.cover import Cover, cover_of, split_colours
from mtm_audit.tracking.gather import Gather, Progress, steady
from mtm_onboard.protocol.errors import MtmError

_LEAST_COVER = 0.1  # of a pixel; less is the noise of compression
_LEAST_AREA_PX = 30.0
_REACH_PX = 60


class CentroidTracker:
    """Follows one thing of a colour that lines, shadows or other things may cut into pieces.

    Each pixel counts by how much of the colour it shows, within `reach_px` of the last place in each direction, or
    in the whole picture while the thing has not been seen. Other things of that colour must stay farther away.
    """

    pixels: Literal["gray", "bgr"] = "bgr"

    def __init__(self, colour: str, reach_px: int = _REACH_PX, name: str = "centroid") -> None:
        if reach_px < 1:
            raise MtmError(
                f"a reach of {reach_px} pixels holds nothing; give at least half the width of what is followed"
            )
        self._colour, self._cover, self._reach_px, self._name = colour, cover_of(colour), reach_px, name

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """One track in pixels with y up; raises MtmError when the colour is never seen or the picture changes size."""
        following = self.following()
        for frame in steady(frames, progress):
            following.look(frame)
        tracks = following.tracks()
        if not tracks:
            raise MtmError(
                f"nothing of the colour {self._colour} found in {following.frames} frames; name the colour that the "
                "robot has in the picture, for instance as #rrggbb"
            )
        return tracks

    def following(self) -> "CentroidFollowing":
        """What follows the colour from frame to frame."""
        return CentroidFollowing(self._cover, self._reach_px, self._name)


class CentroidFollowing:
    """Follows one thing of a colour, as `CentroidTracker` has it."""

    pixels: Literal["gray", "bgr"] = "bgr"
    flipped = False

    def __init__(self, cover: Cover, reach_px: int, name: str) -> None:
        self._cover, self._reach_px, self._name = cover, reach_px, name
        self._gather = Gather()
        self.frames = 0
        self._place: tuple[float, float] | None = None

    def look(self, frame: Frame) -> None:
        """Find the colour in the next frame."""
        self.frames += 1
        self._gather.next_frame(frame)
        near = self._near(frame.image, self._place) if self._place else None
        self._place = near or _centroid(frame.image, self._cover)
        if self._place is not None:
            self._gather.put(self._name, *self._place)

    def tracks(self) -> list[Track]:
        """One track; none when the colour was never seen."""
        return self._gather.tracks(with_headings=False)

    def latest(self) -> dict[str, tuple[float, float]]:
        """Where the colour is in the last frame."""
        return self._gather.latest()

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self._gather.forget(before_s)

    def _near(self, image: Image, place: tuple[float, float]) -> tuple[float, float] | None:
        left, top = (max(round(coordinate) - self._reach_px, 0) for coordinate in place)
        right, bottom = (round(coordinate) + self._reach_px + 1 for coordinate in place)
        found = _centroid(image[top:bottom, left:right], self._cover)
        return (left + found[0], top + found[1]) if found else None


def parse_centroid(choice: str) -> CentroidTracker:
    """The tracker `centroid:<colour>[,<reach in pixels>]`; raises MtmError for anything else."""
    colour, *reach = split_colours(choice)
    if len(reach) > 1 or not all(part.isdecimal() for part in reach):
        raise MtmError(f"{choice!r} is no colour with a reach in pixels; write centroid:#4040bf or centroid:#4040bf,60")
    return CentroidTracker(colour, int(reach[0]) if reach else _REACH_PX)


def _centroid(image: Image, cover: Cover) -> tuple[float, float] | None:
    """Column and row; None where there is too little of the colour."""
    _, shown = cv2.threshold(cover(image) - _LEAST_COVER, 0.0, 0.0, cv2.THRESH_TOZERO)
    moments = cv2.moments(shown)
    if moments["m00"] < _LEAST_AREA_PX:
        return None
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
