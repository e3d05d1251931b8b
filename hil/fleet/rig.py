"""One run of the RoboMaster world: its settings and its result.

One integer seed decides everything random about a run except its waveforms, which come from the key alone.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count, islice
from typing import Any, Literal

import numpy as np

from hil.plants.mecanum import MecanumParameters, MecanumPlant, calibrated_parameters
from hil.sensors.poses import Trajectory
from hil.vehicles.motion_controller import Plant
from hil.worlds.robomaster import MOST_ROBOTS, ROBOTS, TaskFactory, go_to_goal, random_permutation
from mtm_onboard.protocol import Channel, Codebook, Key, MtmError
from mtm_onboard.protocol.framing import Payload
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.guard import Limits
from mtm_onboard.runtime.message import Message, message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.tick import NoiseAdder

Wire = Literal["can", "plaintext", "mavlink", "direct"]
# Codebook, channel name and, as `Modulator` takes them, the channel's own symbols or a message that changes them.
ModulatorFactory = Callable[[Codebook, str, Any], NoiseAdder]
# From a robot's seed and the place where it starts.
ChassisFactory = Callable[[int, tuple[float, float]], Plant]

SAMPLE_PERIOD_S = 0.01
LIMITS = Limits(speed_mps=1.0, turn_rate_radps=2.0)


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """A run of `seconds`, whose message begins at `start_s` and repeats until the end.

    `symbols` is the whole message, or `payload` what a scheme with framing sends; both are None when the robots move
    without one. The run begins at `unix_s`, and under the rolling schedule its message with the first slot from
    `start_s` on, see `onset_s`; None has slot 0 begin at `start_s`. `wire` "can" is the whole CAN protocol in both
    directions, "direct" gives the same motion without it, and "plaintext" is the EP's text protocol, which rounds
    commands. `modulator` may put something else, such as the C shim, in the place of the Python one, `task` other work
    in the place of the paper's, and `chassis` another robot in the place of the mecanum one that `plant` describes.
    There are as many robots as the scheme has bodies, or `robots`, of which the others send nothing.
    Raises MtmError when the key does not fit this world or the spans make no sense.
    """

    key: Key
    symbols: tuple[int, ...] | None
    seconds: float
    seed: int
    wire: Wire = "can"
    start_s: float = 1.5
    modulator: ModulatorFactory = Modulator
    plant: MecanumParameters = field(default_factory=calibrated_parameters)
    payload: Payload | None = None
    unix_s: float | None = None
    task: TaskFactory = go_to_goal
    chassis: ChassisFactory | None = None
    robots: int | None = None

    def __post_init__(self) -> None:
        robots, bodies = len(self.names), len(self._bodies)
        if self.robots is not None and self.robots < bodies:
            raise MtmError(f"the key's scheme moves {bodies} bodies; give --robots {bodies} or more, or another key")
        if robots > MOST_ROBOTS:
            raise MtmError(f"{robots} robots do not fit into the arena; it holds {MOST_ROBOTS}")
        if not (self.start_s >= 0.0 and self.onset_s < self.seconds < np.inf):
            raise MtmError(
                f"the run lasts {self.seconds:g} s and its message begins at {self.onset_s:g} s; make it last longer"
            )
        if self.symbols is not None and self.payload is not None:
            raise MtmError("both symbols and a payload are given; choose one")
        self.message()
        if self.seed < 0:
            raise MtmError(f"the seed is {self.seed}; give a whole number from 0 on")

    @property
    def names(self) -> tuple[str, ...]:
        """The robots: the scheme's bodies in its order, and then those that send nothing."""
        bodies = self._bodies
        others = (name for number in count() if (name := f"robot{number}") not in bodies)
        return (*bodies, *islice(others, max(0, (self.robots or 0) - len(bodies))))

    def channels(self, name: str) -> tuple[Channel, ...]:
        """What the robot of that name plays: the channels of its body that the key holds."""
        grant = self.key.holding.grant
        own = (channel for channel in self.key.scheme.channels if channel.body == name)
        return tuple(channel for channel in own if grant is None or channel.name in grant.channels)

    @property
    def _bodies(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(channel.body for channel in self.key.scheme.channels))

    @property
    def first_slot(self) -> int:
        """The slot that the message begins with; 0 under the fixed schedule."""
        scheme = self.key.scheme
        if scheme.schedule == "fixed" or self.unix_s is None:
            return 0
        return next_slot(self.unix_s + self.start_s, scheme)

    @property
    def onset_s(self) -> float:
        """When the message begins, in seconds since the run's beginning."""
        if self.key.scheme.schedule == "fixed" or self.unix_s is None:
            return self.start_s
        return slot_start_unix_s(self.first_slot, self.key.scheme) - self.unix_s

    def new_chassis(self, seed: int, position_xy_m: tuple[float, float]) -> Plant:
        """One robot's chassis, which stands there with heading zero."""
        if self.chassis is not None:
            return self.chassis(seed, position_xy_m)
        return MecanumPlant(self.plant, seed, position_xy_m)

    def message(self) -> Message | None:
        """What the robots send; raises MtmError when the scheme does not carry it."""
        content = self.symbols if self.payload is None else self.payload
        return None if content is None else message_of(content, self.key)


@dataclass(frozen=True)
class Seeds:
    """Independent random sources of one run: one of each robot's slip, one of the world, one of the sensors."""

    slips: tuple[int, ...]
    world: np.random.SeedSequence
    sensors: np.random.SeedSequence

    def permutation(self) -> tuple[int, ...]:
        """Which target each robot drives to in the end."""
        return random_permutation(np.random.default_rng(self.world), len(self.slips))


def seeds_of(seed: int, robots: int = ROBOTS) -> Seeds:
    """The sources that one integer gives; a robot's are the same however many there are."""
    slips, world, sensors = np.random.SeedSequence(seed).spawn(3)
    return Seeds(tuple(int(word) for word in slips.generate_state(robots, np.uint64)), world, sensors)


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """Counts of one robot, in ticks unless noted; `faults` counts what either end of its link found wrong.

    `late_s` are the median and the 99th percentile of how late its ticks began, zero in simulated time.
    """

    name: str
    sent: int
    missed: int
    clamped: int
    stale: int
    refused: int
    faults: int
    deadman_stops: int
    is_stopped: bool
    late_s: tuple[float, float] = (0.0, 0.0)

    @property
    def is_clean(self) -> bool:
        """Whether there was no fault and the motors were off after the run; missed and clamped ticks are no faults."""
        return self.is_stopped and not (self.stale or self.refused or self.faults or self.deadman_stops)


@dataclass(frozen=True)
class RunResult:
    """The true motion at 100 Hz from the start of the run on, when in it the message began, and the robots' reports."""

    trajectories: tuple[Trajectory, ...]
    onset_s: float
    robots: tuple[RobotReport, ...]
