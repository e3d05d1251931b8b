"""The pose of a body that every writer of the tests writes and every reader must give back."""

from dataclasses import dataclass

import numpy as np

UNIX_S = 1_700_000_000.0


@dataclass(frozen=True)
class Pose:
    """Times from zero (n,), positions (n, 3) with z up, headings (n,)."""

    name: str
    times_s: np.ndarray
    positions_m: np.ndarray
    headings_rad: np.ndarray

    @property
    def quaternions_xyzw(self):
        half = 0.5 * self.headings_rad
        zeros = np.zeros_like(half)
        return np.stack([zeros, zeros, np.sin(half), np.cos(half)], axis=1)

    def rows(self):
        """Time, position and quaternion of each sample."""
        return zip(self.times_s.tolist(), self.positions_m.tolist(), self.quaternions_xyzw.tolist(), strict=True)


def pose_of(track):
    """The pose of a track, which turns to and fro while it moves."""
    positions_m = np.column_stack([track.positions, np.full(len(track.times_s), 0.25)])
    return Pose(track.name, track.times_s, positions_m, 0.4 + 1.2 * np.sin(0.7 * track.times_s))


def driving(name="robot0", seconds=3.0, rate_hz=100.0, place_m=(0.0, 0.0)):
    """A body that drives a figure of eight."""
    times_s = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    x, y = np.sin(0.9 * times_s), 0.6 * np.sin(1.8 * times_s)
    positions_m = np.column_stack([x + place_m[0], y + place_m[1], np.full(len(times_s), 0.25)])
    return Pose(name, times_s, positions_m, 0.4 + 1.2 * np.sin(0.7 * times_s))
