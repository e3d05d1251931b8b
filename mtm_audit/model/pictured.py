"""Tracks where the pictures of a film show them."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Floats, Track


@dataclass(frozen=True)
class Pictured:
    """`tracks` as a film's pictures of `size` (width, height) show them, before the camera's motion was taken out.

    `flipped` says that they are those of the mirrored pictures.
    """

    tracks: tuple[Track, ...]
    size: tuple[int, int]
    flipped: bool = False

    def places(self, track: Track) -> Floats | None:
        """Columns and rows (n, 2), y down, NaN where not seen; None for a track that is no place in a picture."""
        if track.unit != "px":
            return None
        columns, rows = track.positions[:, 0], self.size[1] - 1.0 - track.positions[:, 1]
        return np.stack([self.size[0] - 1.0 - columns if self.flipped else columns, rows], axis=1)

    def headings_rad(self, track: Track) -> Floats | None:
        """Headings (n,) counter-clockwise from the picture's right; None where they are not known."""
        if track.headings_rad is None or not self.flipped:
            return track.headings_rad
        return np.pi - track.headings_rad
