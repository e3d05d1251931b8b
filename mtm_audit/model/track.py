"""Tracks: where each observed thing was, and when."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]


# Farther than anything is seen; a slip in a file, which sums of squares could not hold.
FARTHEST = 1e9


@dataclass(frozen=True)
class Track:
    """Positions of one body over time.

    `times_s` (n,) strictly increasing, the recording's own clock; `positions` (n, axes) in `unit` ("m", "px",
    "rad"), NaN where not observed; `valid` (n,) False where not observed. `axes` name the columns ("x", "y").
    `headings_rad` (n,), counter-clockwise from +x in the frame of `positions`, where the tracker knows it (NaN
    where it does not); `heading_axis` the axis of a body in three dimensions whose direction they are. `extent_px` is
    how large the body is in the picture, where a tracker knows it, and `corners` (n, 4, 2) are those of a square marker
    on it, in order, where it is seen by one. An occluded body is missing data, never zeros.
    Raises MtmError when the arrays disagree.
    """

    name: str
    times_s: Floats
    positions: Floats
    valid: Bools
    axes: tuple[str, ...] = ("x", "y")
    unit: str = "m"
    headings_rad: Floats | None = None
    heading_axis: str | None = None
    extent_px: float | None = None
    corners: Floats | None = None

    def __post_init__(self) -> None:
        count = len(self.times_s)
        if self.positions.shape != (count, len(self.axes)) or self.valid.shape != (count,):
            raise MtmError(f"track {self.name!r}: times, positions and validity differ in length; record it anew")
        if self.headings_rad is not None and self.headings_rad.shape != (count,):
            raise MtmError(f"track {self.name!r}: times and headings differ in length; record it anew")
        if self.corners is not None and self.corners.shape != (count, 4, 2):
            raise MtmError(f"track {self.name!r}: times and corners differ in length; record it anew")
        if count and not np.all(np.isfinite(self.times_s)):
            raise MtmError(f"track {self.name!r} has times that are not numbers; remove those lines")
        if np.any(np.diff(self.times_s) <= 0):
            row = int(np.argmax(np.diff(self.times_s) <= 0)) + 1
            raise MtmError(
                f"track {self.name!r}: time {self.times_s[row]:.6f} s in row {row + 1} does not come after the one "
                "before it; sort the rows and remove repeated times"
            )
        if not np.all(np.isfinite(self.positions[self.valid])):
            raise MtmError(f"track {self.name!r} has positions that are not numbers; leave those rows out")
        if np.any(np.abs(self.positions[self.valid]) > FARTHEST):
            raise MtmError(f"track {self.name!r} has positions beyond {FARTHEST:g} {self.unit}; leave those rows out")
