"""Dictionaries of markers: their names, what reads the same in a mirror, and which of them a film shows."""

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np

from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.errors import MtmError

USUAL = "4x4_50"
_SIZES = ("50", "100", "250", "1000")
_SQUARES = ("4x4", "5x5", "6x6", "7x7")
_TAGS = ("apriltag_36h11", "apriltag_36h10", "apriltag_25h9", "apriltag_16h5", "aruco_mip_36h12", "aruco_original")
DICTIONARIES = (*(f"{square}_{size}" for square in _SQUARES for size in _SIZES), *_TAGS)
# The largest of each family, those first whose markers lie far apart: they are seldom read out of another's.
FAMILIES = (
    "apriltag_36h11", "aruco_mip_36h12", "apriltag_36h10", "6x6_1000", "7x7_1000", "5x5_1000", "apriltag_25h9",
    "4x4_1000", "aruco_original", "apriltag_16h5",
)  # fmt: skip
# What is most used of a family's sizes; markers have the same numbers in all of them.
_USUAL_SIZE = 250
_TWICE = 2
_FEWEST_WORDS = "apriltag_16h5"
LEAST_CELL_PX = 2.0  # of a marker that is named; what is read of less is mostly writing


@lru_cache
def dictionary_of(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of that name, such as `6x6_250` or `apriltag_36h11`; raises MtmError for others."""
    if name not in DICTIONARIES:
        raise MtmError(f"there is no dictionary of markers {name!r}; choose one of: {', '.join(DICTIONARIES)}")
    # OpenCV's versions differ in which letters are large.
    constant = next(constant for constant in vars(cv2.aruco) if constant.lower() == f"dict_{name}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, constant))


def cells_of(name: str) -> int:
    """How many cells a marker's side has, the border's two among them."""
    return int(dictionary_of(name).markerSize) + 2


def detector_parameters() -> cv2.aruco.DetectorParameters:
    """What all searches share: markers from a fiftieth of the picture's larger side on, corners by their contours."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = 0.02
    # A quad around a marker, such as the robot's own outline, hides it when the picture's border cuts that quad.
    parameters.minDistanceToBorder = 0
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    return parameters


@lru_cache(maxsize=4096)
def reads_in_a_mirror(name: str, number: int) -> bool:
    """Whether the marker's mirror image is read as a marker too, so that it does not tell which way a picture is."""
    cell_px = 8
    cells = cells_of(name)
    sheet = cv2.aruco.generateImageMarker(dictionary_of(name), number, cell_px * cells)
    sheet = cv2.copyMakeBorder(sheet[:, ::-1], *(3 * cell_px,) * 4, cv2.BORDER_CONSTANT, value=255)
    return cv2.aruco.ArucoDetector(dictionary_of(name)).detectMarkers(sheet)[1] is not None


def shown_instead(images: Sequence[Image], chosen: str) -> str | None:
    """What `images` show in place of markers of the `chosen` dictionary, such as `6x6_250 markers 3 and 7 are`.

    None when they show no marker of any dictionary. A marker counts that is read without a wrong cell, in two of the
    pictures where there are as many.
    """
    flipped = [np.ascontiguousarray(image[:, ::-1]) for image in images]
    family, best = max(
        (_seen_of(family, way) for way in (images, flipped) for family in FAMILIES),
        key=lambda found: sum(found[1].values()),
    )
    if not best:
        return None
    numbers = [str(number) for number in sorted(best)]
    listed = numbers[0] if len(numbers) == 1 else f"{', '.join(numbers[:-1])} and {numbers[-1]}"
    name = size_for(family, max(best), chosen)
    return f"{name} marker {listed} is" if len(numbers) == 1 else f"{name} markers {listed} are"


def exact_readings(family: str, image: Image) -> list[tuple[int, Floats]]:
    """Numbers and corners (4, 2) of the family's markers in a picture that are large, and read without a wrong cell."""
    parameters = detector_parameters()
    parameters.errorCorrectionRate = 0.0
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    least_px = LEAST_CELL_PX * cells_of(family)
    quads, numbers, _ = cv2.aruco.ArucoDetector(dictionary_of(family), parameters).detectMarkers(image)
    found = [] if numbers is None else np.ravel(numbers)
    return [
        (int(number), np.asarray(quad, dtype=np.float64).reshape(4, 2))
        for number, quad in zip(found, quads, strict=True)
        if np.sqrt(cv2.contourArea(quad)) >= least_px
    ]


def has_quads(image: Image) -> bool:
    """Whether a picture shows any dark quadrangle that might be a marker."""
    quads, _, others = cv2.aruco.ArucoDetector(dictionary_of(_FEWEST_WORDS), detector_parameters()).detectMarkers(image)
    return bool(len(quads) or len(others))


def _seen_of(family: str, images: Sequence[Image]) -> tuple[str, dict[int, int]]:
    """The family, and in how many pictures each of its markers is, those left out that chance may have made."""
    counts: Counter[int] = Counter()
    for image in images:
        counts.update({number for number, _ in exact_readings(family, image)})
    least = min(_TWICE, len(images))
    return family, {number: count for number, count in counts.items() if count >= least}


def size_for(family: str, largest: int, chosen: str | None = None) -> str:
    """The dictionary of a family that holds the numbers; the usual one unless that was looked through already."""
    square, _, size = family.rpartition("_")
    if size != _SIZES[-1]:
        return family
    name = f"{square}_{_USUAL_SIZE}"
    return name if largest < _USUAL_SIZE and name != chosen else family
