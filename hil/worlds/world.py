"""What every simulated world gives: rollouts of its task under any noise, and pictures of them.

The worlds are those of the paper's Section "Results"; its appendix "Policy and Controller Details" says how they are
driven. A world steps its own simulator under a noise array that was computed before: neither the onboard loop nor its
guard nor a wire is part of it (see docs/worlds.md).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.tracking.registry import Tracker
from mtm_onboard.protocol import MtmError, Scheme

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Shot:
    """One uninterrupted filmed part of a rollout, which begins with tick `first_tick`.

    `times_s` (n + 1,): instants of the frames, one before its first tick and one after each of its n ticks, on the
    recording's clock; `states` (n + 1, k): where everything is, in columns of the world's own.
    """

    first_tick: int
    times_s: Floats
    states: Floats


@dataclass(frozen=True)
class ControlHistory:
    """The commands of a rollout, tick by tick.

    `base` (n, axes) is the task controller's command, `requested` (n, axes) the same with the noise, `applied` (n,
    axes) what the world's limits left of that; `scores` are the paper's measures of the task, by name.
    """

    base: Floats
    requested: Floats
    applied: Floats
    scores: Mapping[str, float]


@dataclass(frozen=True)
class Rollout:
    """One run of the task: its filmed shots in order, and its commands without the ticks that were not filmed."""

    shots: tuple[Shot, ...]
    control: ControlHistory


class World(Protocol):
    """A simulated system with its task.

    `axes` name what can carry a signal, `<body>.<axis>`, in the order of the last axis of every noise array. `goals` is
    the number of goals of the paper's rollouts and `choices` out of how many each is. `task_ticks` is how long a
    rollout of the paper's task measure takes, `picture_px` width and height of its pictures.
    """

    name: str
    rate_hz: float
    axes: tuple[str, ...]
    goals: int
    choices: int
    task_ticks: int
    picture_px: tuple[int, int]

    def run(self, goals: Integers, noise: Floats, seeds: Sequence[int]) -> list[Rollout]:
        """One filmed rollout for each seed, which pursues one goal after the other under noise.

        `goals` (rollouts, goals) are numbers below `choices`; `noise` (rollouts, goals, ticks, axes) in units of the
        command, one goal being pursued for that many ticks. The seed decides everything else.
        """
        ...

    def perform(self, noise: Floats, seeds: Sequence[int]) -> list[ControlHistory]:
        """Commands and scores of the paper's task, once a seed, under `noise` (rollouts, task_ticks, axes)."""
        ...

    def pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot as the world's own renderer would show it, drawn by the software camera: blue, green, red."""
        ...

    def native_pictures(self, shot: Shot) -> Iterator[Frame]:
        """The shot drawn by the simulator's own renderer; raises MtmError that says what is missing for that."""
        ...

    def tracker(self) -> Tracker:
        """The paper's tracker for this world's pictures."""
        ...


def check_axes(world: World, scheme: Scheme) -> None:
    """Raise MtmError when the scheme uses an axis that the world does not have."""
    used = [f"{channel.body}.{axis}" for channel in scheme.channels for axis in channel.axes]
    foreign = [axis for axis in used if axis not in world.axes]
    if foreign:
        raise MtmError(f"{world.name} has no axis {foreign[0]!r}; its axes are: {', '.join(world.axes)}")
