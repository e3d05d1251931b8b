"""What a rate costs: symbols right at 5, 6 and 8 bits/s a robot, by the matched detector and the genie.

Four robots drive the paper's zigzag at 0.5 m/s and send four symbols each, with an onset that is known. Schemes with a
yaw axis carry every symbol on x, y and yaw together, against the task's own turning: the controller that holds the
heading turns back what the message turns.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from rich.console import Console

from hil.experiments.detectors.bench_recording import ONSET_S, Integers
from hil.experiments.detectors.bench_rollout import GENIE, MATCHED, plant_of
from hil.experiments.detectors.capacity import capacity_bps
from hil.experiments.detectors.rates_genie import read_genie
from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import MecanumParameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.decoding.views import parts_of
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.windows import make_window
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.reference_frame import ReferenceFrame
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Channel, Codebook, Key, Scheme
from mtm_onboard.protocol.framing import channel_symbols

DETECTORS = (MATCHED, GENIE)
# Reported seeds count from here; what was tuned was tuned on smaller ones.
FIRST_SEED = 900_000
WINDOWS = 4
SIGMA_MPS, SIGMA_RADPS = 0.1, 0.2

_KEYS_STREAM, _SYMBOLS_STREAM, _SILENT_SEED = 21, 22, 2_100_000
_SILENCES, _SILENT_S = 12, 17.5


@dataclass(frozen=True)
class RateJob:
    """An alphabet and a window in ticks, on x and y alone or with `yaw`."""

    alphabet_size: int
    window_ticks: int
    yaw: bool

    @property
    def scheme(self) -> Scheme:
        """The paper's scheme for this world with this job's numbers."""
        paper = fleet_scheme(self.window_ticks * WINDOWS)
        axes: tuple[str, ...] = ("vx", "vy", "wz") if self.yaw else ("vx", "vy")
        sigma = (SIGMA_MPS, SIGMA_MPS, SIGMA_RADPS) if self.yaw else SIGMA_MPS
        channels = tuple(replace(channel, axes=axes, symbols=WINDOWS, sigma=sigma) for channel in paper.channels)
        return replace(paper, alphabet_size=self.alphabet_size, channels=channels)

    @property
    def rate_bps(self) -> float:
        """Bits per second of one robot."""
        return float(np.log2(self.alphabet_size) * self.scheme.rate_hz / self.window_ticks)


JOBS = (RateJob(4096, 120, yaw=False), RateJob(4096, 100, yaw=False), RateJob(65_536, 133, yaw=False),
        RateJob(65_536, 100, yaw=True))  # fmt: skip


@dataclass(frozen=True)
class RateRow:
    """Symbols right of one job by detector, and the channel's capacity in bits per second of one robot."""

    job: RateJob
    symbols: dict[str, Proportion]
    capacity_bps: float


def rate_rows(
    jobs: Sequence[RateJob],
    plant: MecanumParameters,
    rollouts: int,
    store: CellStore,
    console: Console,
    *,
    seed: int = FIRST_SEED,
    workers: int | None = None,
) -> list[RateRow]:
    """Every job measured on as many rollouts; those that the store has are not computed again."""
    rows = []
    for job in jobs:
        cells = [Cell("rates", {**asdict(job), **asdict(plant)}, seed + number) for number in range(rollouts)]
        results = run_sweep(read_rate, cells, store, console, workers)
        trials = ROBOTS * WINDOWS * rollouts
        right = {name: Proportion(sum(int(each[name]) for each in results), trials) for name in DETECTORS}
        rows.append(RateRow(job, right, job_capacity_bps(job, plant)))
    return rows


def read_rate(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The number of symbols that each detector has right in one rollout, by the detector's name."""
    job = RateJob(int(parameters["alphabet_size"]), int(parameters["window_ticks"]), bool(parameters["yaw"]))
    plant = plant_of(parameters)
    scheme = job.scheme
    key = Key("rates", np.random.default_rng([_KEYS_STREAM, seed]).bytes(32), scheme)
    drawn = np.random.default_rng([_SYMBOLS_STREAM, seed]).integers(scheme.alphabet_size, size=scheme.message_symbols)
    parts = channel_symbols(tuple(drawn.tolist()), scheme)
    sent = np.array([parts[channel.name] for channel in scheme.channels])
    end_s = ONSET_S + scheme.message_ticks / scheme.rate_hz
    tracks = _tracks(key, tuple(drawn.tolist()), end_s, plant, seed)
    kinds = _kinds(scheme, tracks)
    silences = _silent_kinds(job, end_s, plant)
    decided = {
        MATCHED: read_matched(key.codebook(), kinds),
        GENIE: read_genie(key.codebook(), kinds, silences, plant, sent),
    }
    return {name: int(np.sum(symbols == sent)) for name, symbols in decided.items()}


def read_matched(codebook: Codebook, kinds: Sequence[tuple[Sequence[Channel], Sequence[Motion]]]) -> Integers:
    """Symbols (robots, windows), without knowing the plant; what velocities and turning say is added up."""
    found: dict[int, Floats] = {}
    # As `decode` does: what turning says of the symbols helps the velocities, read once more, to learn the plant.
    order = [*range(len(kinds)), *([0] if len(kinds) > 1 else [])]
    for kind in order:
        channels, motions = kinds[kind]
        timing = Timing(ONSET_S, codebook.scheme.rate_hz)
        windows = [
            make_window(codebook, channel, motion, timing, robot, window, window)
            for robot, (channel, motion) in enumerate(zip(channels, motions, strict=True))
            for window in range(WINDOWS)
        ]
        noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
        others = [ratios for other, ratios in found.items() if other != kind]
        elsewhere = list(np.sum(others, axis=0)) if others else None
        found[kind] = np.array(estimate(windows, motions, noise, elsewhere=elsewhere).ratios)
    decided: Integers = np.asarray(np.argmax(np.sum(list(found.values()), axis=0), axis=1)).reshape(-1, WINDOWS)
    return decided


def job_capacity_bps(job: RateJob, plant: MecanumParameters) -> float:
    """Capacity of all axes with each one's power spread evenly over the band, see `capacity`."""
    scheme = job.scheme
    total = 0.0
    for (channels, _), motions in zip(_kinds_of(scheme), _silent_kinds(job, _SILENT_S, plant), strict=True):
        total += capacity_bps(plant, channels[0].sigmas[0], scheme.rate_hz, scheme.band_hz, motions)
    return total


def _kinds_of(scheme: Scheme) -> list[tuple[list[Channel], tuple[str, ...]]]:
    """The channels' planar axes, and those of turning where they have one."""
    kinds = [axes for axes in (("vx", "vy"), ("wz",)) if set(axes) <= set(scheme.channels[0].axes)]
    return [([channel.on(axes) for channel in scheme.channels], axes) for axes in kinds]


def _kinds(scheme: Scheme, tracks: Sequence[Track]) -> list[tuple[list[Channel], list[Motion]]]:
    """Channels and motions of each kind: along the robots' own axes where their turning is read as well."""
    frame: ReferenceFrame = "body" if "wz" in scheme.channels[0].axes else "world"
    seen = [
        parts_of(channel, glimpse_of_track(track), frame)
        for channel, track in zip(scheme.channels, tracks, strict=True)
    ]
    return [
        (
            [parts[kind].channel for parts in seen],
            [uniform_motion(parts[kind].glimpse, scheme.band_hz[1]) for parts in seen],
        )
        for kind in range(len(seen[0]))
    ]


def _tracks(
    key: Key, symbols: tuple[int, ...] | None, seconds: float, plant: MecanumParameters, seed: int
) -> list[Track]:
    start_s = ONSET_S if symbols is not None else 0.0
    settings = RunSettings(
        key=key, symbols=symbols, seconds=seconds + 0.1, seed=seed, wire="direct", start_s=start_s, plant=plant
    )
    return [_until(seconds, track) for track in motion_capture_tracks(run_lockstep(settings), seed, MotionCapture())]


def _until(end_s: float, track: Track) -> Track:
    count = int(np.searchsorted(track.times_s, end_s + 1e-6))
    headings = None if track.headings_rad is None else track.headings_rad[:count]
    return replace(
        track, times_s=track.times_s[:count], positions=track.positions[:count], valid=track.valid[:count],
        headings_rad=headings,
    )  # fmt: skip


_silent: dict[tuple[RateJob, float, MecanumParameters], list[list[Motion]]] = {}


def _silent_kinds(job: RateJob, seconds: float, plant: MecanumParameters) -> list[list[Motion]]:
    """Motions of each kind without a message, of recordings on none of which is measured."""
    place = (job, seconds, plant)
    if place not in _silent:
        key = Key("rates", bytes(32), job.scheme)
        recordings = [
            _kinds(job.scheme, _tracks(key, None, seconds, plant, _SILENT_SEED + number)) for number in range(_SILENCES)
        ]
        count = len(recordings[0])
        _silent[place] = [[motion for one in recordings for motion in one[kind][1]] for kind in range(count)]
    return _silent[place]
