"""Motion of the simulated fleet as the estimate takes it, for its tests."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings, seeds_of
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.detectors.matched.estimate import Estimate, estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.windows import Window, make_windows
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Key

FAKE_SECRET = b"not a real secret, only for test"
START_S = 1.5
RATE_HZ = 50.0
ON_TIME = Timing(START_S, RATE_HZ)


@dataclass(frozen=True)
class FleetRun:
    key: Key
    symbols: tuple[int, ...]
    tracks: tuple[Track, ...]


@lru_cache(maxsize=16)
def fleet_run(
    seed=1, message_ticks=150, seconds=None, *, alphabet=4, sends=True, per_channel=1, combine="split", noon_unix_s=None
):
    """A run over the direct wire, filmed by motion capture, with its symbols in the order of the message.

    With `noon_unix_s` the schedule is rolling, and that is the time of day at which the message begins.
    """
    plain = fleet_scheme(message_ticks)
    channels = tuple(replace(channel, symbols=per_channel) for channel in plain.channels)
    scheme = replace(plain, channels=channels, alphabet_size=alphabet, combine=combine)
    by_clock = {}
    if noon_unix_s is not None:
        scheme, by_clock = replace(scheme, schedule="rolling"), {"unix_s": noon_unix_s - START_S}
    key = Key("fake", FAKE_SECRET, scheme)
    symbols = tuple(np.random.default_rng(seed).integers(0, alphabet, scheme.message_symbols).tolist())
    seconds = START_S + message_ticks / RATE_HZ + 0.6 if seconds is None else seconds
    settings = RunSettings(
        key=key,
        symbols=symbols if sends else None,
        seconds=seconds,
        seed=seed,
        wire="direct",
        start_s=START_S,
        **by_clock,
    )
    tracks = motion_capture_tracks(run_lockstep(settings), seeds_of(seed).slips[0] % 1000, MotionCapture())
    return FleetRun(key, symbols, tuple(tracks))


def motions_of(run: FleetRun, tracks=None) -> list[Motion]:
    return [uniform_motion(glimpse_of_track(track), 5.0) for track in (run.tracks if tracks is None else tracks)]


def windows_of(run: FleetRun, motions, count=1, timing=ON_TIME) -> list[Window]:
    """The first `count` windows of every channel."""
    codebook = run.key.codebook()
    return [
        window
        for number, (channel, motion) in enumerate(zip(run.key.scheme.channels, motions, strict=True))
        for window in make_windows(codebook, channel, motion, timing, number, range(count))
    ]


def estimated(run: FleetRun, tracks=None, count=1, profile=None) -> Estimate:
    motions = motions_of(run, tracks)
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    return estimate(windows_of(run, motions, count), motions, noise, profile)


def turned(track: Track, angle_rad: float, *, mirrored: bool = False) -> Track:
    """The same motion seen by a camera that is turned, and perhaps by way of a mirror."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    matrix = np.array([[cosine, -sine], [sine, cosine]])
    if mirrored:
        matrix = matrix @ np.diag([1.0, -1.0])
    return replace(track, positions=track.positions @ matrix.T)
