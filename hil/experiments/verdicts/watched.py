"""Whether watching and stopping at the first verdict is honest: streams of poses of robots that send nothing.

One cell is a rollout of four robots, each watched by itself on simulated time, with every look that the schedule has:
no look is left out because a machine is busy. Task, window, alphabet, key and rate are drawn from the cell's seed.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import calibrated_parameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from hil.worlds.tasks import random_task
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.events import Pose
from mtm_audit.live.judges import JudgeHere
from mtm_audit.live.judging import Judged
from mtm_audit.live.watching import Poses, Watch
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Channel, Key

SECONDS = 60.0
_STREAM = 704
_WINDOWS_TICKS = (150, 200, 300)
_ALPHABETS = (2, 4, 16)
_RATES_HZ = (10.0, 25.0, 30.0)


@dataclass(frozen=True)
class WatchedSummary:
    """Streams watched for `SECONDS` each, the looks at them, how many of these were more than a glance, verdicts, and
    the most evidence of any look, paid for, in bits.
    """

    streams: int
    looks: int
    weighed: int
    decoded: int
    inconclusive: int
    most_bits: float


def watched_cells(streams: int, first_seed: int) -> list[Cell]:
    """Cells with at least so many streams."""
    count = -(-streams // ROBOTS)
    return [Cell("silent watches", {"seconds": SECONDS}, first_seed + number) for number in range(count)]


def watch_silent(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Watch four robots that send nothing."""
    draw = np.random.default_rng([_STREAM, seed])
    scheme = replace(fleet_scheme(int(draw.choice(_WINDOWS_TICKS))), alphabet_size=int(draw.choice(_ALPHABETS)))
    key = Key("asked", draw.bytes(32), scheme)
    seconds = float(parameters["seconds"])
    settings = RunSettings(
        key=key, symbols=None, seconds=seconds + 0.2, seed=seed, wire="direct", start_s=0.2, task=random_task,
        plant=calibrated_parameters(),
    )  # fmt: skip
    system = MotionCapture(rate_hz=float(draw.choice(_RATES_HZ)), dropout_probability=float(draw.choice((0.0, 0.05))))
    tracks = motion_capture_tracks(run_lockstep(settings), seed, system)
    audience = Tally()
    for robot, track in enumerate(tracks):
        channel = scheme.channels[robot]
        alone = (Channel(channel.name, channel.body, channel.axes, 1, channel.sigma),)
        watch_track(track, replace(key, scheme=replace(scheme, channels=alone)), seconds, audience)
    return audience.result(len(tracks))


def watch_track(track: Track, key: Key, seconds: float, audience: "Tally") -> Watch:
    """Watch one body for so long."""
    watch = Watch(key.scheme, Poses(), JudgeHere(key, DecodeSettings()), audience, waits=True, most_s=seconds)
    watch.run(poses_of(track))
    best = None if watch.best is None else watch.best.decoding
    audience.verdicts[best.verdict if best else "absent"] += 1
    return watch


def poses_of(track: Track) -> Iterator[Pose]:
    """The samples of a track as a sender would send them."""
    for time_s, (x, y), valid in zip(track.times_s, track.positions, track.valid, strict=True):
        yield Pose(track.name, float(time_s), float(x) if valid else np.nan, float(y) if valid else np.nan)


@dataclass
class Tally:
    """Counts what watches tell."""

    looks: int = 0
    weighed: int = 0
    most_bits: float = -np.inf
    verdicts: Counter[str] = field(default_factory=Counter)

    def shown(self, event: Frame | Pose, watched_s: float) -> None:
        """Not counted."""

    def noticed(self, sentence: str) -> None:
        """Not counted."""

    def judged(self, judged: Judged) -> None:
        """Count a look."""
        self.looks += 1
        if judged.decoding is not None:
            self.weighed += 1
            self.most_bits = max(self.most_bits, judged.decoding.evidence.bits)

    def result(self, streams: int) -> dict[str, Scalar]:
        """The counts of so many streams."""
        return {
            "streams": streams,
            "looks": self.looks,
            "weighed": self.weighed,
            "decoded": self.verdicts["decoded"],
            "inconclusive": self.verdicts["inconclusive"],
            "most_bits": float(self.most_bits),
        }


def summarise_watched(results: Sequence[Values]) -> WatchedSummary:
    """All cells together."""

    def total(name: str) -> int:
        return sum(int(result[name]) for result in results)

    most_bits = max((float(result["most_bits"]) for result in results), default=-np.inf)
    return WatchedSummary(
        total("streams"), total("looks"), total("weighed"), total("decoded"), total("inconclusive"), most_bits
    )
