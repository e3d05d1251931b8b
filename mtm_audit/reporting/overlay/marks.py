"""What to draw on one picture of a film: the tracks as they were seen, and the symbols that pass."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.palette import colour_of
from mtm_audit.model.picture import Image
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.track import Floats, Track
from mtm_audit.reporting.overlay.passing import Windows
from mtm_audit.tracking.follower import BODY_SIDES
from mtm_audit.tracking.markers import MarkerFinder

_TRAIL_S = 1.5
# Of what trackers keep clear around a coloured patch or a region: about the thing itself.
_OWN_SHARE = 0.5
_NUMBER = re.compile(r"marker(\d+)[b-z]?")


@dataclass(frozen=True, eq=False)
class _Shown:
    """A track in pixels of the pictures; `places` is None for one that is no place in a picture."""

    track: Track
    places: Floats | None
    headings_rad: Floats | None


class Marker:
    """Makes the marks of a film's pictures, whose tracks are `pictured`, from the file's time of each picture.

    `bodies` are the names of tracks by the body that they show. Outlines of markers are measured anew in each picture,
    from the `dictionary`; without one, things are drawn as large as the tracker knew them to be.
    """

    def __init__(
        self, pictured: Pictured, windows: Sequence[Windows], bodies: dict[str, str], dictionary: str | None
    ) -> None:
        self._flipped = pictured.flipped
        self._shown = [_Shown(track, pictured.places(track), pictured.headings_rad(track)) for track in pictured.tracks]
        self._windows, self._bodies = windows, bodies
        self._finder = None if dictionary is None else MarkerFinder(dictionary)

    def marks(self, image: Image, time_s: float) -> list[Mark]:
        """The marks of the gray picture that was taken at `time_s`; none where the tracker saw no such picture."""
        return [mark for number, shown in enumerate(self._shown) if (mark := self._mark(number, shown, image, time_s))]

    def _mark(self, number: int, shown: _Shown, image: Image, time_s: float) -> Mark | None:
        track = shown.track
        row = int(np.searchsorted(track.times_s, time_s))
        if row == len(track.times_s) or track.times_s[row] != time_s:
            return None
        bodies = [body for body, name in self._bodies.items() if name == track.name]
        passing = [
            window
            for windows in self._windows
            if windows.track == track.name and (window := windows.passing(time_s)) is not None
        ]
        several = len({windows.channel for windows in self._windows if windows.track == track.name}) > 1
        notes = [f"{window.channel} {window.symbol}" if several else f"symbol {window.symbol}" for window in passing]
        seen = bool(track.valid[row])
        if shown.places is None:
            notes += _angles(track, row)
        if not seen:
            notes.append("not seen")
        first = int(np.searchsorted(track.times_s, time_s - _TRAIL_S))
        heading = None if shown.headings_rad is None or not seen else float(shown.headings_rad[row])
        places = np.empty((0, 2)) if shown.places is None else shown.places[first : row + 1]
        at_place = seen and len(places) > 0
        return Mark(
            name=_name(track.name, bodies),
            place=(float(places[-1, 0]), float(places[-1, 1])) if at_place else None,
            outline=self._outline(shown, row, image) if at_place else None,
            heading_rad=heading,
            trail=places,
            notes=tuple(notes),
            passed=passing[0].passed if passing else None,
            colour=colour_of(number),
        )

    def _outline(self, shown: _Shown, row: int, image: Image) -> Floats | None:
        """Around the thing: a marker's corners as the picture shows them, or what is known of its size."""
        assert shown.places is not None
        place, extent_px = shown.places[row], shown.track.extent_px
        if extent_px is None:
            return None
        number = _NUMBER.fullmatch(shown.track.name)
        if self._finder is None or number is None:
            return _circle(place, _OWN_SHARE * extent_px)
        heading = 0.0 if shown.headings_rad is None else float(shown.headings_rad[row])
        expected = _square(place, extent_px / BODY_SIDES, heading)
        found = self._finder.near(*self._readable(image, int(number[1]), expected))
        if found is None:
            return expected
        return self._unflipped(found.corners, image.shape[1])

    def _readable(self, image: Image, number: int, expected: Floats) -> tuple[Image, int, Floats]:
        """The picture in which the marker can be read, and where it is expected there."""
        if not self._flipped:
            return image, number, expected
        return np.ascontiguousarray(image[:, ::-1]), number, self._unflipped(expected, image.shape[1])

    def _unflipped(self, points: Floats, width_px: int) -> Floats:
        return np.stack([width_px - 1 - points[:, 0], points[:, 1]], axis=1) if self._flipped else points


def _name(track: str, bodies: Sequence[str]) -> str:
    """The body first, as the report has it, and the track where that has another name."""
    others = [body for body in bodies if body != track]
    return " · ".join([*others, track])


def _angles(track: Track, row: int) -> list[str]:
    """What a track of joint angles says; nothing where it was not seen."""
    if not track.valid[row]:
        return []
    return [f"{axis} {np.degrees(angle):.1f}°" for axis, angle in zip(track.axes, track.positions[row], strict=True)]


def _circle(middle: Floats, diameter_px: float) -> Floats:
    turns = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    return np.asarray(middle + 0.5 * diameter_px * np.stack([np.cos(turns), np.sin(turns)], axis=1))


def _square(middle: Floats, side_px: float, heading_rad: float) -> Floats:
    along = 0.5 * side_px * np.array([np.cos(heading_rad), -np.sin(heading_rad)])
    across = np.array([-along[1], along[0]])
    return np.asarray(middle + np.array([-along - across, along - across, along + across, -along + across]))
