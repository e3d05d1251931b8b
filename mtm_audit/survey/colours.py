"""Which saturated colours some pictures show, and where."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats
from mtm_audit.tracking.colour import LEAST_AREA_PX
from mtm_audit.tracking.cover import CHROMA
from mtm_audit.tracking.region import Region

# Twice what a tracker needs at least, so that what is named is found again in every picture.
_LEAST_CHROMA = 40.0
_BINS = 72
_SMOOTHED_BINS = 5
_NEAR_DEG = 20.0  # of one colour; trackers take hues within 27 degrees for one
_MOST_COLOURS = 8
_LEAST_SHARE, _MOST_SHARE = 4e-5, 0.1  # of the picture; larger areas are a floor or a wall
_MOVED_SIDES = 0.25


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownColour:
    """A colour as `--tracker colour:` takes it, its hue in degrees (0 red, 120 green, 240 blue), and its patches.

    `boxes` are the largest patch in each picture that shows one, by the picture's number: left, upper, right and lower
    edge. `patches` is the largest number of them in one picture, `share` the largest part of a picture that is of the
    colour, and `moves` says whether the largest patch is in different places.
    """

    name: str
    hue_deg: float
    boxes: dict[int, Region]
    patches: int
    share: float
    moves: bool

    @property
    def is_background(self) -> bool:
        """Whether it is too large for a robot's patch."""
        return self.share > _MOST_SHARE


def find_colours(frames: Sequence[Frame]) -> tuple[ShownColour, ...]:
    """The colours of patches that stand out in half of the pictures or more, those that move first."""
    chromas = [_chroma(frame.image) for frame in frames]
    found = []
    for hue_deg in _hues(chromas):
        colour = _colour(hue_deg, frames, chromas)
        if colour is not None:
            found.append(colour)
    found.sort(key=lambda colour: (not colour.moves, colour.is_background, -colour.share))
    return tuple(found[:_MOST_COLOURS])


def _chroma(image: Image) -> Floats:
    """Blue and red against green (height, width, 2), the noise of single pixels smoothed away."""
    soft = cv2.GaussianBlur(image, (3, 3), 0)
    return np.asarray(cv2.transform(soft.astype(np.float32), CHROMA.astype(np.float32)))


def _angles_deg(chroma: Floats) -> Floats:
    return np.asarray(np.degrees(np.arctan2(chroma[..., 1], chroma[..., 0])))


def _strong(chroma: Floats) -> Floats:
    return np.asarray(np.linalg.norm(chroma, axis=-1) > _LEAST_CHROMA)


def _hues(chromas: Sequence[Floats]) -> list[float]:
    """Angles of chroma, in degrees, around which those of strong pixels gather."""
    angles = np.concatenate([_angles_deg(chroma[_strong(chroma)]) for chroma in chromas])
    counts = np.histogram(angles, bins=_BINS, range=(-180.0, 180.0))[0].astype(float)
    pixels = chromas[0].shape[0] * chromas[0].shape[1]
    smooth = sum(np.roll(counts, shift) for shift in range(-(_SMOOTHED_BINS // 2), _SMOOTHED_BINS // 2 + 1))
    smooth = np.asarray(smooth)
    hues: list[float] = []
    for index in np.argsort(-smooth, kind="stable"):
        angle = -180.0 + (index + 0.5) * 360.0 / _BINS
        if smooth[index] < _LEAST_SHARE * pixels * len(chromas) / 2:
            break
        if all(abs((angle - other + 180.0) % 360.0 - 180.0) > 2 * _NEAR_DEG for other in hues):
            hues.append(float(angle))
    return hues


def _colour(hue_deg: float, frames: Sequence[Frame], chromas: Sequence[Floats]) -> ShownColour | None:
    boxes: dict[int, Region] = {}
    colours, shares, counts = [], [], []
    for picture, (frame, chroma) in enumerate(zip(frames, chromas, strict=True)):
        near = np.abs((_angles_deg(chroma) - hue_deg + 180.0) % 360.0 - 180.0) < _NEAR_DEG
        own = (near & _strong(chroma)).astype(np.uint8)
        shares.append(float(own.mean()))
        count, labels, table, _ = cv2.connectedComponentsWithStats(own, connectivity=8)
        areas = table[1:, cv2.CC_STAT_AREA]
        least = max(LEAST_AREA_PX, _LEAST_SHARE * own.size)
        if count < 2 or areas.max() < least:
            continue
        largest = 1 + int(np.argmax(areas))
        left, upper, width, height = (int(value) for value in table[largest, : cv2.CC_STAT_AREA])
        boxes[picture] = (left, upper, left + width, upper + height)
        counts.append(int(np.sum(areas >= least)))
        colours.append(np.median(frame.image[labels == largest], axis=0))
    if len(boxes) < max(1, len(frames) / 2):
        return None
    bgr = np.median(colours, axis=0)
    name = "#" + "".join(f"{round(float(value)):02x}" for value in bgr[::-1])
    return ShownColour(
        name=name, hue_deg=_hue_deg(bgr), boxes=boxes, patches=max(counts), share=max(shares), moves=_moves(boxes)
    )


def _moves(boxes: dict[int, Region]) -> bool:
    corners = np.array(list(boxes.values()), dtype=float)
    middles = (corners[:, :2] + corners[:, 2:]) / 2
    side_px = float(np.median(np.max(corners[:, 2:] - corners[:, :2], axis=1)))
    return bool(np.ptp(middles, axis=0).max() > max(_MOVED_SIDES * side_px, 2.0))


def _hue_deg(bgr: Floats) -> float:
    pixel = np.rint(bgr).astype(np.uint8).reshape(1, 1, 3)
    return 2.0 * float(cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0, 0])
