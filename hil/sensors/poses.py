"""The input of the sensors: each robot's trajectory, and the times when it is occluded."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """The true motion of one robot in the world frame (z up), sampled densely.

    `times_s` (n,) strictly increasing; `positions_xy_m` (n, 2); `headings_rad` (n,), counter-clockwise from +x,
    wrapped or not. Raises MtmError when the arrays disagree or hold fewer than two samples.
    """

    name: str
    times_s: Floats
    positions_xy_m: Floats
    headings_rad: Floats

    def __post_init__(self) -> None:
        count = len(self.times_s)
        if count < 2 or self.positions_xy_m.shape != (count, 2) or self.headings_rad.shape != (count,):
            raise MtmError(
                f"trajectory {self.name!r}: times, positions and headings must be of one length of at least 2; "
                "sample the world anew"
            )
        if np.any(np.diff(self.times_s) <= 0):
            raise MtmError(f"trajectory {self.name!r}: times must increase from sample to sample; sort the samples")

    def at(self, instants_s: Floats) -> tuple[Floats, Floats]:
        """Positions (m, 2) and unwrapped headings (m,) at `instants_s` (m,), linearly interpolated.

        Before the first and after the last sample the robot stands still.
        """
        positions = [np.interp(instants_s, self.times_s, self.positions_xy_m[:, axis]) for axis in range(2)]
        headings = np.interp(instants_s, self.times_s, np.unwrap(self.headings_rad))
        return np.stack(positions, axis=-1), headings


@dataclass(frozen=True)
class Occlusion:
    """The robot `name` cannot be seen from `start_s` up to, but not including, `end_s` (world time)."""

    name: str
    start_s: float
    end_s: float


def occluded(occlusions: tuple[Occlusion, ...], name: str, instants_s: Floats) -> NDArray[np.bool_]:
    """True at the `instants_s` (m,) at which the robot `name` cannot be seen; shape (m,)."""
    hidden = np.zeros(len(instants_s), dtype=np.bool_)
    for occlusion in occlusions:
        if occlusion.name == name:
            hidden |= (instants_s >= occlusion.start_s) & (instants_s < occlusion.end_s)
    return hidden


def common_span_s(trajectories: list[Trajectory]) -> tuple[float, float]:
    """First and last instant that all trajectories cover; raises MtmError when there is none."""
    if not trajectories:
        raise MtmError("there is no robot to record; put at least one into the world")
    start_s = max(float(trajectory.times_s[0]) for trajectory in trajectories)
    end_s = min(float(trajectory.times_s[-1]) for trajectory in trajectories)
    if end_s <= start_s:
        raise MtmError("the trajectories share no span of time; sample all robots over the same run")
    return start_s, end_s
