"""One thing that was seen in a picture, as it is drawn there."""

from dataclasses import dataclass, field, replace

import numpy as np

from mtm_audit.drawing.palette import WHITE, Bgr
from mtm_audit.model.track import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Mark:
    """All places are columns and rows of the picture, y down, from the upper left corner; they may lie outside of it.

    `place` is where it is now, None when it is not seen; `outline` (k, 2) goes around it, None where that is not known,
    and `heading_rad` is counter-clockwise from the picture's right. `trail` (n, 2) is where it has been, the newest
    last, NaN where it was not seen. `notes` are lines under its name, and `passed` says how much of something, such as
    a symbol's window, is over: 0 to 1, None for no bar.
    """

    name: str
    place: tuple[float, float] | None
    outline: Floats | None = None
    heading_rad: float | None = None
    trail: Floats = field(default_factory=lambda: np.empty((0, 2)))
    notes: tuple[str, ...] = ()
    passed: float | None = None
    colour: Bgr = WHITE

    @property
    def last_place(self) -> tuple[float, float] | None:
        """Where it is, or was last in its trail; None when it was not seen there either."""
        if self.place is not None:
            return self.place
        seen = self.trail[np.isfinite(self.trail).all(axis=1)]
        return (float(seen[-1, 0]), float(seen[-1, 1])) if len(seen) else None

    def scaled(self, factor: float) -> "Mark":
        """The same mark in a picture that is `factor` times as large."""
        place = None if self.place is None else (factor * self.place[0], factor * self.place[1])
        outline = None if self.outline is None else factor * self.outline
        return replace(self, place=place, outline=outline, trail=factor * self.trail)
