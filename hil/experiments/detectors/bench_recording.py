"""The recordings of the benchmark: what is sent in one, and what each detector observes of it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import ModulatorFactory, RunSettings, seeds_of
from hil.plants.mecanum import MecanumParameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.model.glimpse import Glimpse, glimpse_of_track
from mtm_onboard.protocol import Codebook, Key, Scheme
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.runtime.modulator import Modulator

Integers = NDArray[np.int64]

ONSET_S = 1.5
# The slowest rate that the paper's detector tries, 0.8 of the true one, looks at 1.25 messages of motion.
_LONGEST_MESSAGE = 1.25
_KEYS_STREAM, _SYMBOLS_STREAM = 1, 2


@dataclass(frozen=True)
class Job:
    """What each of the four robots sends: `windows` symbols of an alphabet, `window_ticks` each, at `sigma` (m/s)."""

    alphabet_size: int
    window_ticks: int
    windows: int
    sigma: float

    @property
    def scheme(self) -> Scheme:
        """The paper's scheme for this world with this job's numbers."""
        paper = fleet_scheme(self.window_ticks * self.windows)
        channels = tuple(replace(channel, symbols=self.windows, sigma=self.sigma) for channel in paper.channels)
        return replace(paper, alphabet_size=self.alphabet_size, channels=channels)

    @property
    def end_s(self) -> float:
        """When the message ends, counted from the start of the recording."""
        return ONSET_S + self.windows * self.window_ticks / self.scheme.rate_hz


@dataclass(frozen=True)
class Recording:
    """One rollout.

    `symbols` (robots, windows) were sent; `seen` is each robot's motion up to the message's end, `longer` up to a
    quarter of the message after that, as the lowest rate of the paper's detector needs.
    """

    codebook: Codebook
    symbols: Integers
    seen: tuple[Glimpse, ...]
    longer: tuple[Glimpse, ...]


def record(job: Job, plant: MecanumParameters, seed: int, modulator: ModulatorFactory = Modulator) -> Recording:
    """A rollout with a key of its own.

    With one window a robot it is the paper's experiment (tab:robomaster-indep), in which each robot's symbol is the
    number of the target that it drives to; with more windows the symbols are random.
    """
    key = Key("bench", np.random.default_rng([_KEYS_STREAM, seed]).bytes(32), job.scheme)
    symbols = seeds_of(seed).permutation() if job.windows == 1 else _random_symbols(job, seed)
    seconds = ONSET_S + _LONGEST_MESSAGE * (job.end_s - ONSET_S) + 0.1
    longer = glimpses_of(
        RunSettings(
            key=key,
            symbols=symbols,
            seconds=seconds,
            seed=seed,
            wire="direct",
            start_s=ONSET_S,
            modulator=modulator,
            plant=plant,
        )
    )
    parts = channel_symbols(symbols, job.scheme)
    sent = np.array([parts[channel.name] for channel in job.scheme.channels])
    return Recording(key.codebook(), sent, tuple(until(job.end_s, glimpse) for glimpse in longer), longer)


def record_silence(seconds: float, plant: MecanumParameters, seed: int) -> tuple[Glimpse, ...]:
    """Each robot's motion in the same task without a message."""
    key = Key("bench", bytes(32), fleet_scheme())
    return glimpses_of(
        RunSettings(key=key, symbols=None, seconds=seconds, seed=seed, wire="direct", start_s=0.0, plant=plant)
    )


def _random_symbols(job: Job, seed: int) -> tuple[int, ...]:
    generator = np.random.default_rng([_SYMBOLS_STREAM, seed])
    return tuple(int(symbol) for symbol in generator.integers(job.alphabet_size, size=ROBOTS * job.windows))


def glimpses_of(settings: RunSettings) -> tuple[Glimpse, ...]:
    """Each robot's motion as motion capture shows it in that run."""
    tracks = motion_capture_tracks(run_lockstep(settings), settings.seed, MotionCapture())
    return tuple(glimpse_of_track(track) for track in tracks)


def until(end_s: float, glimpse: Glimpse) -> Glimpse:
    """The part of a glimpse up to `end_s`, with a tolerance of 1 us for rounding."""
    count = int(np.searchsorted(glimpse.edges_s, end_s + 1e-6)) - 1
    return replace(
        glimpse,
        edges_s=glimpse.edges_s[: count + 1],
        velocities=glimpse.velocities[:count],
        valid=glimpse.valid[:count],
    )
