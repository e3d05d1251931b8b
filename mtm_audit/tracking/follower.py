"""Following markers from picture to picture, each copy of a marker by its continuity."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.dictionaries import reads_in_a_mirror
from mtm_audit.tracking.gather import Gather, Place
from mtm_audit.tracking.markers import MarkerFinder, Sighting

READ_EVERY_S = 0.25  # after which a marker's number is read again
SURPRISE_SIDES = 0.08  # how far a corner may be from where it is expected, in sides, without being read
SEARCH_EVERY_S = 0.75  # after which the whole picture is searched for markers that are new
FULL_SEARCH_EVERY = 3  # of those searches; the others are quick
SEEN_AT_LEAST = 3  # frames; what is read less often is a chance reading of something else
# For a marker out of sight the whole picture is searched in every frame at first, and then each time that it has been
# so for a fifth longer.
AT_ONCE_S, PATIENCE = 0.5, 0.2
NEARBY_S = 1.0  # for which a marker out of sight is looked for around its last place in every frame
BODY_SIDES = 3.0
SIDES_PER_S = 15.0  # faster than any robot: 2.7 m/s with a marker of 18 cm
_COPIES = "bcdefghijklmnopqrstuvwxyz"

# A marker's number, and which of its copies: 0, 1 and so on in the order of their appearance.
Copy = tuple[int, int]
# Where the copies were seen, by their keys and the numbers of frames.
Seen = dict[str, dict[int, Place]]


@dataclass(frozen=True)
class _Followed:
    """A copy of a marker as it was last seen, how far its corners had moved since before, and in how many frames.

    `read_s` is when its number was last read; in between, its sides alone are followed.
    """

    sighting: Sighting
    step: Floats
    seen_s: float
    read_s: float
    count: int

    def expected(self, lost: bool) -> Floats:
        """Its corners in the next frame, at constant velocity; one that is lost is where it was."""
        return self.sighting.corners if lost else self.sighting.corners + self.step

    def gap_sides(self, sighting: Sighting) -> float:
        """How many of its sides it would have gone to be that one."""
        return float(np.linalg.norm(sighting.centre - self.sighting.centre)) / self.sighting.side_px


class MarkerFollower:
    """Follows all markers in the pictures of one film, or in their mirror images."""

    def __init__(self, dictionary: str, *, mirrored: bool) -> None:
        self._dictionary, self._mirrored = dictionary, mirrored
        self._finder = MarkerFinder(dictionary)
        self._gather = Gather()
        self._followed: dict[Copy, _Followed] = {}
        self._places: dict[Copy, list[Floats]] = {}
        self._searched_s = self._last_s = -np.inf
        self._quick_searches = 0
        # Sightings by number of markers that cannot be read in a mirror, and of all markers.
        self.decisive: Counter[int] = Counter()
        self.sightings = 0

    def look(self, frame: Frame) -> None:
        """Find the markers of the next frame."""
        self._gather.next_frame(frame)
        image: Image = np.ascontiguousarray(frame.image[:, ::-1] if self._mirrored else frame.image)
        is_read_s = {copy: self._followed[copy].read_s for copy in self._followed}
        continued = self._continued(image, frame.time_s)
        read = self._nearby(image, frame.time_s, except_for=continued)
        found = continued | read
        is_lost = self._is_lost_one_due(found, frame.time_s)
        if is_lost or frame.time_s - self._searched_s >= SEARCH_EVERY_S:
            self._searched_s = frame.time_s
            is_full = is_lost or self._quick_searches + 1 >= FULL_SEARCH_EVERY
            self._quick_searches = 0 if is_full else self._quick_searches + 1
            search = self._finder.everywhere if is_full else self._finder.quickly
            self._add_new(search(image), found, frame.time_s)
        rough = [copy for copy in found if copy not in continued]
        fine = continued | dict(zip(rough, self._finder.refined(image, [found[copy] for copy in rough]), strict=True))
        for copy, sighting in fine.items():
            self._note(copy, sighting, frame.time_s, is_read_s[copy] if copy in continued else frame.time_s)
        self._last_s = frame.time_s

    def tracks(self) -> list[Track]:
        """One track per marker that was seen often enough, named `marker<number>`.

        Of copies that show at once the one that goes farthest has that name, the next `marker<number>b` and so on.
        More frames may follow.
        """
        seen = {key: dict(places) for key, places in self._gather.seen.items()}
        often = {copy: name for copy, name in self._names(seen).items() if len(seen[_key(copy)]) >= SEEN_AT_LEAST}
        named = Gather(
            self._gather.height_px,
            self._gather.times_s,
            {name: seen[_key(copy)] for copy, name in often.items()},
            {name: self._gather.extents_px[_key(copy)] for copy, name in often.items()},
        )
        return named.tracks(with_headings=True)

    def latest(self) -> dict[str, tuple[float, float]]:
        """Column and row of each marker in the last frame, as it was looked at; of several copies one."""
        return {f"marker{key.partition('/')[0]}": place for key, place in self._gather.latest().items()}

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self._gather.forget(before_s)

    def _continued(self, image: Image, time_s: float) -> dict[Copy, Sighting]:
        """The markers whose sides are where they are expected and as long as before; they were read a moment ago."""
        recent = {
            copy: last
            for copy, last in self._followed.items()
            if last.seen_s == self._last_s and last.count > 1 and time_s - last.read_s < READ_EVERY_S
        }
        expected = [Sighting(copy[0], last.expected(lost=False)) for copy, last in recent.items()]
        fine = self._finder.refined(image, expected, keep=False)
        pairs = zip(recent.items(), expected, fine, strict=True)
        return {
            copy: now
            for (copy, last), guess, now in pairs
            if np.abs(now.corners - guess.corners).max() < SURPRISE_SIDES * last.sighting.side_px
        }

    def _nearby(self, image: Image, time_s: float, except_for: dict[Copy, Sighting]) -> dict[Copy, Sighting]:
        """The other followed markers that are read where they are expected."""
        found: dict[Copy, Sighting] = {}
        # What was seen last comes first: a copy that is lost may not claim another that passes its place.
        for copy, last in sorted(self._followed.items(), key=lambda item: -item[1].seen_s):
            if copy in except_for:
                continue
            if time_s - last.seen_s <= NEARBY_S or last.seen_s == self._last_s:
                sighting = self._finder.near(image, copy[0], last.expected(lost=last.seen_s < self._last_s))
                taken = [*except_for.values(), *found.values()]
                if sighting is None or any(_is_there(one, sighting) for one in taken):
                    continue
                if last.gap_sides(sighting) < self._reach_sides(last, time_s):
                    found[copy] = sighting
        return found

    def _is_lost_one_due(self, found: dict[Copy, Sighting], time_s: float) -> bool:
        """Whether to search for a marker that is out of sight, or for the first one."""
        since_s = time_s - self._searched_s
        if not self._followed:
            return True
        lost = [last for copy, last in self._followed.items() if copy not in found]
        for last in lost:
            lost_s = time_s - last.seen_s
            # A chance reading is looked for no longer than at once; a marker that came in fast is found by that.
            is_waited_for = last.count >= SEEN_AT_LEAST or lost_s <= AT_ONCE_S
            if is_waited_for and since_s >= PATIENCE * (lost_s - AT_ONCE_S):
                return True
        return False

    def _add_new(self, sightings: list[Sighting], found: dict[Copy, Sighting], time_s: float) -> None:
        """Give each sighting that is not among the `found` to the copy it continues, or make it a new one."""
        for sighting in sightings:
            if any(_is_there(one, sighting) for one in found.values()):
                continue
            copies = [copy for copy in self._followed | found if copy[0] == sighting.number]
            unseen = [copy for copy in copies if copy not in found]
            near = [
                copy
                for copy in unseen
                if self._followed[copy].gap_sides(sighting) < self._reach_sides(self._followed[copy], time_s)
            ]
            if near:
                found[min(near, key=lambda copy: self._followed[copy].gap_sides(sighting))] = sighting
            elif len(copies) <= len(_COPIES):
                found[sighting.number, len(copies)] = sighting

    def _reach_sides(self, last: _Followed, time_s: float) -> float:
        return 1.0 + SIDES_PER_S * (time_s - last.seen_s)

    def _note(self, copy: Copy, sighting: Sighting, time_s: float, read_s: float) -> None:
        column, row = sighting.centre
        # A robot's body reaches beyond its marker, and its shadow beyond that.
        extent_px = BODY_SIDES * sighting.side_px
        self._gather.put(_key(copy), float(column), float(row), sighting.heading_rad, extent_px, sighting.corners)
        last = self._followed.get(copy)
        is_next = last is not None and last.seen_s == self._last_s
        step = sighting.corners - last.sighting.corners if last is not None and is_next else np.zeros((4, 2))
        self._followed[copy] = _Followed(sighting, step, time_s, read_s, 1 + (last.count if last else 0))
        self.sightings += 1
        if not reads_in_a_mirror(self._dictionary, sighting.number):
            self.decisive[sighting.number] += 1

    def _names(self, seen: Seen) -> dict[Copy, str]:
        names: dict[Copy, str] = {}
        for number in {number for number, _ in self._followed}:
            self._join(number, seen)
            copies = [copy for copy in self._followed if copy[0] == number and _key(copy) in seen]
            copies.sort(key=lambda copy: _reach_px(seen[_key(copy)]), reverse=True)
            names |= {copy: f"marker{number}{letter}" for copy, letter in zip(copies, ["", *_COPIES], strict=False)}
        return names

    def _join(self, number: int, seen: Seen) -> None:
        """Make copies one that never show in the same frame: a marker that leapt."""
        copies = [_key(copy) for copy in self._followed if copy[0] == number]
        for place, later in enumerate(copies):
            for earlier in copies[:place]:
                if earlier in seen and not seen[earlier].keys() & seen[later].keys():
                    seen[earlier] |= seen.pop(later)
                    break


def _reach_px(places: Mapping[int, Place]) -> float:
    return float(np.ptp(np.array(list(places.values()))[:, :2], axis=0).max())


def _key(copy: Copy) -> str:
    return f"{copy[0]}/{copy[1]}"


def _is_there(one: Sighting, other: Sighting) -> bool:
    apart_px = float(np.linalg.norm(one.centre - other.centre))
    return one.number == other.number and apart_px < 0.5 * max(one.side_px, other.side_px)
