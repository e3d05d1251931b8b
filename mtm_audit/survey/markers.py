"""Which markers some pictures show, of whatever dictionary."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.spread import spread_evenly
from mtm_audit.model.track import Floats
from mtm_audit.tracking.dictionaries import (
    FAMILIES,
    USUAL,
    cells_of,
    dictionary_of,
    exact_readings,
    has_quads,
    size_for,
)

_TWICE = 2
_TURNS = 4
_PROBED = 3  # pictures that tell whether a family is there at all
# Of two markers of the usual dictionary, or of one of a larger: less may be read by chance, or in a mirror.
_SURE_BITS = 16.0
_USUAL_FAMILY, _USUAL_COUNT = "4x4_1000", 50


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownMarker:
    """A marker of `dictionary`: its `corners` (4, 2), columns and rows, in each of the pictures where it was seen.

    `corners` are by the number of the picture; `side_px` is the median side.
    """

    dictionary: str
    number: int
    corners: dict[int, Floats]
    side_px: float

    @property
    def name(self) -> str:
        """As tracks of markers are called."""
        return f"marker{self.number}"


@dataclass(frozen=True)
class ShownMarkers:
    """All markers that were found, and whether they can be read in the mirrored pictures alone."""

    markers: tuple[ShownMarker, ...] = ()
    mirrored: bool = False

    @property
    def dictionaries(self) -> tuple[str, ...]:
        """Their dictionaries, that of most markers first."""
        names = [marker.dictionary for marker in self.markers]
        return tuple(sorted(dict.fromkeys(names), key=lambda name: -names.count(name)))


def find_markers(frames: Sequence[Frame]) -> ShownMarkers:
    """Markers that are read without a wrong cell in two of the pictures, or in one where there is no second.

    Where two dictionaries read something in one place, that counts whose markers lie farther apart. The pictures are
    mirrored when what is read then is less likely to be chance.
    """
    images = [_gray(frame.image) for frame in frames]
    shown = [picture for picture, image in enumerate(images) if has_quads(image)]
    plain = _found(images, shown)
    if _bits(plain) >= _SURE_BITS:
        return ShownMarkers(plain)
    mirrored = _found([np.ascontiguousarray(image[:, ::-1]) for image in images], shown)
    if _bits(mirrored) <= _bits(plain):
        return ShownMarkers(plain)
    width = images[0].shape[1]
    return ShownMarkers(tuple(_unflipped(marker, width) for marker in mirrored), True)


def _bits(markers: Sequence[ShownMarker]) -> float:
    """How unlikely it is that random cells read as these markers: -log2 of the chance, by their dictionaries' sizes."""
    total = 0.0
    for name in {marker.dictionary for marker in markers}:
        cells = (cells_of(name) - 2) ** 2
        words = _TURNS * len(dictionary_of(name).bytesList)
        total += sum(marker.dictionary == name for marker in markers) * (cells - float(np.log2(words)))
    return total


def _found(images: Sequence[Image], shown: Sequence[int]) -> tuple[ShownMarker, ...]:
    """The markers in those of the images that may show some."""
    least = min(_TWICE, len(images))
    taken: list[list[Floats]] = [[] for _ in images]
    found: list[ShownMarker] = []
    probed = [shown[number] for number in spread_evenly(len(shown), _PROBED)]
    for family in FAMILIES:
        places: dict[int, dict[int, Floats]] = {}
        # Most families are in no picture at all, and each picture costs a search.
        for picture in sorted(shown, key=lambda number: number not in probed):
            if picture not in probed and not places:
                break
            for number, corners in sorted(
                exact_readings(family, images[picture]), key=lambda reading: -_side_px(reading[1])
            ):
                if not any(_is_there(corners, other) for other in taken[picture]):
                    places.setdefault(number, {}).setdefault(picture, corners)
        often = {number: seen for number, seen in places.items() if len(seen) >= least}
        for number, seen in sorted(often.items()):
            side_px = float(np.median([_side_px(corners) for corners in seen.values()]))
            found.append(ShownMarker(dictionary=family, number=number, corners=seen, side_px=side_px))
            for picture, corners in seen.items():
                taken[picture].append(corners)
    return tuple(_in_usual_size(marker, found) for marker in found)


def _in_usual_size(marker: ShownMarker, found: Sequence[ShownMarker]) -> ShownMarker:
    """The marker in the smallest usual dictionary that holds all of its family that were found."""
    largest = max(other.number for other in found if other.dictionary == marker.dictionary)
    is_usual = marker.dictionary == _USUAL_FAMILY and largest < _USUAL_COUNT
    name = USUAL if is_usual else size_for(marker.dictionary, largest)
    return ShownMarker(dictionary=name, number=marker.number, corners=marker.corners, side_px=marker.side_px)


def _gray(image: Image) -> Image:
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _side_px(corners: Floats) -> float:
    return float(np.mean(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)))


def _is_there(one: Floats, other: Floats) -> bool:
    apart_px = float(np.linalg.norm(one.mean(axis=0) - other.mean(axis=0)))
    return apart_px < 0.5 * max(_side_px(one), _side_px(other))


def _unflipped(marker: ShownMarker, width_px: int) -> ShownMarker:
    corners = {
        picture: np.stack([width_px - 1 - points[:, 0], points[:, 1]], axis=1)
        for picture, points in marker.corners.items()
    }
    return ShownMarker(dictionary=marker.dictionary, number=marker.number, corners=corners, side_px=marker.side_px)
