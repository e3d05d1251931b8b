"""The matched detector under uncalibrated cameras, frame times and clocks.

One cell is one rollout of four robots that repeat their symbols, seen under one condition. Tracks are true projections
of the robots through a camera, with the noise of a tracker; a condition changes one thing at a time.
"""

from dataclasses import dataclass, replace

import numpy as np

from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import calibrated_parameters
from hil.sensors.optics import Optics, overhead
from hil.sensors.poses import Trajectory
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.detectors.base import ChannelReading, Observation
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Channel, Key

_STREAM = 4
_START_S = 1.5
_TRACKER_NOISE_PX = 0.1
_TOP_M = 0.2


@dataclass(frozen=True)
class Job:
    """What each robot sends: `windows` symbols of an alphabet of `alphabet_size`, `ticks` each."""

    alphabet_size: int
    ticks: int
    windows: int


# The paper's two bits a robot in a quarter of its time, and four bits a second from each robot.
JOBS = (Job(4, 150, 1), Job(256, 100, 8))


@dataclass(frozen=True)
class Condition:
    """How a recording differs from that of an overhead camera at 30 frames a second whose clock and start are known.

    `intervals_s` bounds the time between frames, `dropped` is the share of lost frames, `hidden_s` the length of each
    robot's one occlusion, `clock` the camera's seconds per second.
    """

    optics: Optics
    intervals_s: tuple[float, float] = (1 / 30, 1 / 30)
    dropped: float = 0.0
    hidden_s: float = 0.0
    clock: float = 1.0
    start_known: bool = True


_TILT_RAD = np.deg2rad(50.0)
_OBLIQUE = Optics(
    position_m=(0.0, -7.5 * float(np.sin(_TILT_RAD)), 7.5 * float(np.cos(_TILT_RAD))),
    target_m=(0.0, 0.0, 0.0),
    focal_px=950.0,
    width_px=1280,
    height_px=960,
    roll_rad=float(np.deg2rad(37.0)),
)

CONDITIONS: dict[str, Condition] = {
    "overhead": Condition(overhead()),
    "rolled 37, tilted 50 degrees": Condition(_OBLIQUE),
    "mirrored": Condition(replace(overhead(), mirrored=True)),
    "20 % of frames dropped, 1 s occluded": Condition(overhead(), dropped=0.2, hidden_s=1.0),
    "frame rate 24 to 60": Condition(overhead(), intervals_s=(1 / 60, 1 / 24)),
    "clock 1 % off, start unknown": Condition(overhead(), clock=1.01, start_known=False),
}


def read_under(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The number of windows `read` and of those `right` in one rollout recorded under one condition."""
    condition = CONDITIONS[str(parameters["condition"])]
    draw = np.random.default_rng([_STREAM, seed])
    job = Job(int(parameters["alphabet_size"]), int(parameters["ticks"]), int(parameters["windows"]))
    plain = fleet_scheme(job.ticks * job.windows)
    channels = tuple(Channel(c.name, c.body, c.axes, job.windows, c.sigma) for c in plain.channels)
    key = Key("rollout", draw.bytes(32), replace(plain, alphabet_size=job.alphabet_size, channels=channels))
    symbols = draw.integers(0, job.alphabet_size, (ROBOTS, job.windows))
    length_s = job.ticks / plain.rate_hz
    # A known start is filmed from before the message to its end; an unknown one from somewhere inside it, and one
    # window longer, so that every symbol is seen whole.
    begin_s = _START_S - 1.0 if condition.start_known else _START_S + float(draw.uniform(0.2, 6.0))
    end_s = begin_s + 1.0 + (job.windows + (not condition.start_known)) * length_s
    sent = tuple(int(symbol) for symbol in symbols.ravel())
    settings = RunSettings(
        key=key,
        symbols=sent,
        seconds=end_s + 0.2,
        seed=seed,
        wire="direct",
        start_s=_START_S,
        plant=calibrated_parameters(),
    )
    result = run_lockstep(settings)
    observations = [
        Observation(channel, glimpse_of_track(_observed_track(trajectory, condition, begin_s, end_s, draw)))
        for channel, trajectory in zip(channels, result.trajectories, strict=True)
    ]
    onset_s = (_START_S - begin_s) * condition.clock
    readings = MatchedDetector().read(key.codebook(), [], observations, onset_s if condition.start_known else None)
    right = read = 0
    for reading, own in zip(readings, symbols, strict=True):
        if isinstance(reading, ChannelReading):
            starts_s = reading.reading.window_starts_s
            numbers = np.rint((starts_s - onset_s) / (length_s * condition.clock)).astype(int)
            last_s = (end_s - begin_s - 0.9 * length_s) * condition.clock
            whole = (starts_s >= -0.1 * length_s) & (starts_s <= last_s)
            decided = np.argmax(reading.reading.window_scores, axis=1)
            right += int(np.sum((decided == own[numbers % job.windows]) & whole))
            read += int(whole.sum())
    return {"read": read, "right": right}


def _observed_track(
    trajectory: Trajectory, condition: Condition, begin_s: float, end_s: float, draw: np.random.Generator
) -> Track:
    """The robot's track in the picture, in the recording's own clock, y up."""
    steps_s = draw.uniform(*condition.intervals_s, size=int((end_s - begin_s) / condition.intervals_s[0]) + 1)
    times_s = begin_s + np.concatenate([[0.0], np.cumsum(steps_s)])
    times_s = times_s[times_s <= end_s]
    kept = draw.random(len(times_s)) >= condition.dropped
    hidden_s = float(draw.uniform(begin_s, end_s - condition.hidden_s))
    kept &= ~((times_s >= hidden_s) & (times_s < hidden_s + condition.hidden_s))
    times_s = times_s[kept]
    positions_m, _ = trajectory.at(times_s)
    pixels = condition.optics.project(np.column_stack([positions_m, np.full(len(times_s), _TOP_M)]))
    pixels = pixels * [1.0, -1.0] + draw.normal(0.0, _TRACKER_NOISE_PX, pixels.shape)
    clock_s: Floats = (times_s - begin_s) * condition.clock
    return Track(trajectory.name, clock_s, pixels, np.ones(len(times_s), dtype=np.bool_), unit="px")
