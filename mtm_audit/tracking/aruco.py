"""Tracking markers: where each is, to a small fraction of a pixel, and where it points."""

from collections.abc import Callable, Iterable
from typing import Literal

from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.track import Track
from mtm_audit.tracking.dictionaries import USUAL, dictionary_of, shown_instead
from mtm_audit.tracking.follower import MarkerFollower
from mtm_audit.tracking.gather import Progress, steady
from mtm_onboard.protocol.errors import MtmError

# One way of reading the pictures is right when it leads by so many markers, or by so many sightings of one.
_LEAD_MARKERS, _LEAD_SIGHTINGS = 3, 30
_MOST_KEPT = 6  # pictures in which other dictionaries are looked for, when they hold no marker of the chosen one


def parse_aruco(choice: str, warn: Callable[[str], None] | None = None) -> "ArucoTracker":
    """The tracker `aruco[:<dictionary>][,mirrored]`; raises MtmError for anything else."""
    parts = [part.strip().lower().removeprefix("dict_") for part in choice.split(",") if part.strip()]
    mirrored = "mirrored" in parts
    names = [part for part in parts if part != "mirrored"]
    if len(names) > 1 or len(parts) > len(names) + 1:
        raise MtmError(
            f"aruco:{choice} names more than one dictionary; write one, such as aruco:6x6_250 or aruco:6x6_250,mirrored"
        )
    return ArucoTracker(True if mirrored else None, names[0] if names else USUAL, warn)


class ArucoTracker:
    """Follows markers of one of OpenCV's dictionaries, searching around where each is expected.

    A marker in a mirrored picture cannot be read until the picture is flipped back. With `mirrored` None both ways
    are tried until one reads more markers that look different in a mirror; tracks are in pixels of the picture that
    can be read. `warn` receives a sentence when that cannot be told, and when a marker is there more than once.
    """

    pixels: Literal["gray", "bgr"] = "gray"

    def __init__(
        self, mirrored: bool | None = None, dictionary: str = USUAL, warn: Callable[[str], None] | None = None
    ) -> None:
        dictionary_of(dictionary)
        self._mirrored, self._dictionary, self._warn = mirrored, dictionary, warn or (lambda sentence: None)
        self.flipped = bool(mirrored)

    @property
    def dictionary(self) -> str:
        """The name of the dictionary whose markers it follows."""
        return self._dictionary

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track every marker in gray `frames`: one track per marker, `marker<id>`, in pixels with y up, with headings.

        Raises MtmError, which names markers of other dictionaries that are there instead, when no marker is found, and
        when the size of the picture changes.
        """
        following = self.following()
        kept = _Kept()
        count = 0
        for frame in steady(frames, progress):
            count += 1
            following.look(frame)
            if not following.has_seen:
                kept.offer(frame.image)
        self.flipped = following.flipped
        tracks = following.tracks()
        if not tracks:
            raise MtmError(self._refusal(count, kept.images))
        if following.is_undecided:
            self._warn(
                f"only markers that look the same in a mirror are seen ({_listed(tracks)}), so nothing tells whether "
                f"the film is mirrored; if it is, name the tracker aruco:{self._dictionary},mirrored"
            )
        self._warn_of_copies(tracks)
        return tracks

    def following(self) -> "ArucoFollowing":
        """What follows the markers from frame to frame."""
        return ArucoFollowing(self._dictionary, (False, True) if self._mirrored is None else (self._mirrored,))

    def _refusal(self, count: int, images: list[Image]) -> str:
        instead = shown_instead(images, self._dictionary)
        if instead is not None:
            name = instead.split()[0]
            return (
                f"no marker of {self._dictionary} found in {count} frames, but {instead} there; decode with "
                f"--tracker aruco:{name}"
            )
        return (
            f"no marker found in {count} frames; film markers of OpenCV's dictionary {self._dictionary} with a white "
            "margin, at least 20 pixels wide, or choose another tracker"
        )

    def _warn_of_copies(self, tracks: list[Track]) -> None:
        names = {track.name for track in tracks}
        for name in sorted(names):
            if name[-1].isdigit() and (copies := sorted(other for other in names if other.rstrip("b-z") == name)):
                others = [copy for copy in copies if copy != name]
                if others:
                    self._warn(
                        f"the marker {name.removeprefix('marker')} is in sight {len(copies)} times: {name} is the one "
                        f"that moves most, {' and '.join(others)} what hangs elsewhere; cover that, or use --assign"
                    )


class ArucoFollowing:
    """Follows markers in the pictures as they are, mirrored, or both ways until one leads."""

    pixels: Literal["gray", "bgr"] = "gray"

    def __init__(self, dictionary: str, ways: tuple[bool, ...]) -> None:
        self._followers = {way: MarkerFollower(dictionary, mirrored=way) for way in ways}
        self._width_px = 0

    @property
    def flipped(self) -> bool:
        """Whether the mirrored way tells more; when nothing tells, the picture is most likely as it was taken."""
        followers = self._followers
        return max(followers, key=lambda way: (sum(followers[way].decisive.values()), not way))

    @property
    def has_seen(self) -> bool:
        """Whether any marker was seen, one way or the other."""
        return any(follower.sightings for follower in self._followers.values())

    @property
    def is_undecided(self) -> bool:
        """Whether nothing that was seen tells the two ways apart."""
        return len(self._followers) > 1 and not self._followers[self.flipped].decisive

    def look(self, frame: Frame) -> None:
        """Find the markers of the next frame."""
        self._width_px = frame.size[0]
        for follower in self._followers.values():
            follower.look(frame)
        if len(self._followers) > 1 and self.has_seen and (way := _leader(self._followers)) is not None:
            self._followers = {way: self._followers[way]}

    def tracks(self) -> list[Track]:
        """One track per marker, as `ArucoTracker.track` has them."""
        return self._followers[self.flipped].tracks()

    def latest(self) -> dict[str, tuple[float, float]]:
        """Where markers are in the last frame, in the picture as it came."""
        way = self.flipped
        found = self._followers[way].latest()
        if not way:
            return found
        return {name: (self._width_px - 1 - column, row) for name, (column, row) in found.items()}

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        for follower in self._followers.values():
            follower.forget(before_s)


class _Kept:
    """Some pictures of a film, evenly spread however long it gets."""

    def __init__(self) -> None:
        self.images: list[Image] = []
        self._every = 1
        self._count = 0

    def offer(self, image: Image) -> None:
        if self._count % self._every == 0:
            self.images.append(image.copy())
            if len(self.images) > _MOST_KEPT:
                self.images, self._every = self.images[::2], 2 * self._every
        self._count += 1


def _leader(followers: dict[bool, MarkerFollower]) -> bool | None:
    """Whether the mirrored way of reading leads; None while neither does."""
    for way in followers:
        ahead = followers[way].decisive - followers[not way].decisive
        if len(ahead) >= _LEAD_MARKERS or sum(ahead.values()) >= _LEAD_SIGHTINGS:
            behind = followers[not way].decisive - followers[way].decisive
            if sum(ahead.values()) > 2 * sum(behind.values()):
                return way
    return None


def _listed(tracks: list[Track]) -> str:
    return ", ".join(track.name.removeprefix("marker") for track in tracks)
