"""Collecting what a tracker sees, frame by frame, into tracks."""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol.errors import MtmError

Progress = Callable[[int], None]
Place = tuple[float, ...]


@dataclass
class Gather:
    """Observations in pixels, x to the right and y up, as (x, y, heading) under a name; one row per frame.

    The corners of a marker follow the heading, x and y of each in turn.

    A body that is not put in between two calls of `next_frame` was not seen in that frame.
    """

    height_px: int = 0
    times_s: list[float] = field(default_factory=list)
    seen: dict[str, dict[int, Place]] = field(default_factory=dict)
    extents_px: dict[str, float] = field(default_factory=dict)

    def next_frame(self, frame: Frame) -> None:
        """Open the row of the next frame."""
        self.height_px = frame.size[1]
        self.times_s.append(frame.time_s)

    def put(
        self,
        name: str,
        column: float,
        row: float,
        heading_rad: float = np.nan,
        extent_px: float = 0.0,
        corners: Floats | None = None,
    ) -> None:
        """Note where a body is in the current frame: picture coordinates (y down), heading counter-clockwise.

        `extent_px` is how large it is, 0 where that is not known; the largest of a film counts. `corners` (4, 2) are
        those of a marker, columns and rows.
        """
        self.extents_px[name] = max(extent_px, self.extents_px.get(name, 0.0))
        self.seen.setdefault(name, {})[len(self.times_s) - 1] = (
            column,
            self.height_px - 1 - row,
            heading_rad,
            *(() if corners is None else np.ravel([0.0, self.height_px - 1] + corners * [1.0, -1.0]).tolist()),
        )

    def latest(self) -> dict[str, tuple[float, float]]:
        """Column and row (y down) of each body that was seen in the current frame."""
        row = len(self.times_s) - 1
        here = {name: places[row] for name, places in self.seen.items() if row in places}
        return {name: (place[0], self.height_px - 1 - place[1]) for name, place in here.items()}

    def forget(self, before_s: float) -> None:
        """Drop the frames that are older than `before_s`, and the bodies seen in none of the others."""
        count = bisect_left(self.times_s, before_s)
        del self.times_s[:count]
        kept = {
            name: {row - count: place for row, place in places.items() if row >= count}
            for name, places in self.seen.items()
        }
        self.seen = {name: places for name, places in kept.items() if places}
        self.extents_px = {name: extent_px for name, extent_px in self.extents_px.items() if name in self.seen}

    def tracks(self, with_headings: bool) -> list[Track]:
        """One track per body, in the order of their names; NaN and not valid in frames in which it was not seen."""
        times_s = np.asarray(self.times_s, dtype=np.float64)
        found = []
        for name in sorted(self.seen):
            places = list(self.seen[name].values())
            table = np.full((len(times_s), len(places[0])), np.nan)
            table[list(self.seen[name])] = places
            valid = np.asarray(np.isfinite(table[:, 0]))
            headings = table[:, 2] if with_headings else None
            corners = table[:, 3:].reshape(-1, 4, 2) if table.shape[1] > 3 else None
            extent_px = self.extents_px.get(name) or None
            found.append(
                Track(
                    name=name,
                    times_s=times_s,
                    positions=table[:, :2],
                    valid=valid,
                    unit="px",
                    headings_rad=headings,
                    extent_px=extent_px,
                    corners=corners,
                )
            )
        return found


def steady(frames: Iterable[Frame], progress: Progress | None = None) -> Iterator[Frame]:
    """Pass frames on, calling `progress` with the number of frames so far.

    Raises MtmError when the size of the picture changes, since pixels would then change their meaning.
    """
    size: tuple[int, int] | None = None
    for count, frame in enumerate(frames, 1):
        check_size(frame, size)
        size = frame.size
        yield frame
        if progress is not None:
            progress(count)


def check_size(frame: Frame, size: tuple[int, int] | None) -> None:
    """Raise MtmError when the frame is not of that size, since pixels would then change their meaning."""
    if size is not None and frame.size != size:
        raise MtmError(
            f"the picture changes from {size[0]} x {size[1]} to {frame.size[0]} x {frame.size[1]} at "
            f"{frame.time_s:.3f} s; cut the video there and decode the parts one by one"
        )
