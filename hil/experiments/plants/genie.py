"""What the linear genie knows of a robot of the family: fitted to other runs of the same robot.

Its response to noise is the best linear one, by ridge regression over runs of the robot without interference, each
with and without noise; where the robot is linear it is the response itself. Its interference is what remains of the
motion, as motion capture shows it, in further runs that play known noise.
"""

import numpy as np
from scipy import signal

from hil.experiments.detectors.linear_genie import (
    TAIL_S,
    GenieKnowledge,
    axis_motion,
    fit_interference,
    symbol_noise,
    travelled,
)
from hil.fleet.driven import sent_track
from hil.fleet.sending import STEP_S, Sending
from hil.plants.responses import Floats
from hil.plants.robots import Robot
from hil.worlds.vehicles import Vehicle
from mtm_audit.detectors.matched.motion import Motion
from mtm_onboard.model.velocity import AXES

_PROBE_S, _RUN_S, _RUNS = 60.0, 20.0, 4
_RIDGE = 1e-4


def knowledge_of(vehicle: Vehicle, robot: Robot, sending: Sending, draw: np.random.Generator) -> GenieKnowledge:
    """What the genie knows of this robot, and of the symbols that `sending` may play."""
    axes = vehicle.kind.axes
    taps = linear_taps(vehicle, robot, sending.sigma, sending.codebook.scheme.band_hz, draw)
    moved = travelled(np.array([_responded(taps, noise) for noise in symbol_noise(sending)]))
    rests = [_unexplained(vehicle, robot, sending, taps, draw) for _ in range(_RUNS)]
    return GenieKnowledge(moved, tuple(fit_interference(rests, axis) for axis in range(len(axes))))


def linear_taps(
    vehicle: Vehicle, robot: Robot, sigma: float, band_hz: tuple[float, float], draw: np.random.Generator
) -> Floats:
    """Impulse responses (followed axes, injected axes, instants of `STEP_S`), newest first, at that loudness."""
    columns = [AXES.index(axis) for axis in vehicle.kind.axes]
    count, memory = round(_PROBE_S / STEP_S), round(TAIL_S / STEP_S)
    course = vehicle.controllers[int(draw.integers(len(vehicle.controllers)))](count, STEP_S, draw)
    # Noise of somewhat more than the band, whose edges would else be left to chance.
    sections = signal.butter(2, (0.6 * band_hz[0], 1.6 * band_hz[1]), "bandpass", fs=1.0 / STEP_S, output="sos")
    noise = signal.sosfilt(sections, draw.standard_normal((count, len(columns))), axis=0)
    noise *= sigma / noise.std(axis=0)
    # It ends early, so that nothing of what follows is cut off.
    noise[-memory:] = 0.0
    loud = course.copy()
    loud[:, columns] += noise
    followed = robot.respond(STEP_S).advance(loud) - robot.respond(STEP_S).advance(course)
    return _solved(noise, followed[:, columns], memory)


def _solved(noise: Floats, followed: Floats, memory: int) -> Floats:
    """The taps with which the noise gives most nearly what was followed, by the normal equations of ridge regression.

    These are Toeplitz in blocks, since the noise ends `memory` instants before the run does.
    """
    axes, count = noise.shape[1], len(noise)
    size = 1 << (2 * count - 1).bit_length()
    spectra, theirs = (np.fft.rfft(each, size, axis=0) for each in (noise, followed))
    width = axes * memory
    normal, right = np.empty((width, width)), np.empty((width, followed.shape[1]))
    lags = np.arange(memory)
    for one in range(axes):
        for other in range(axes):
            correlation = np.fft.irfft(np.conj(spectra[:, other]) * spectra[:, one], size)
            block = correlation[(lags[None, :] - lags[:, None]) % size]
            normal[one * memory : (one + 1) * memory, other * memory : (other + 1) * memory] = block
        cross = np.fft.irfft(np.conj(spectra[:, one, None]) * theirs, size, axis=0)
        right[one * memory : (one + 1) * memory] = cross[:memory]
    normal += np.eye(width) * np.trace(normal) / width * _RIDGE
    return np.asarray(np.linalg.solve(normal, right).T.reshape(followed.shape[1], axes, memory))


def _responded(taps: Floats, noise: Floats) -> Floats:
    """What follows of noise (n, injected axes) by the taps, (n, followed axes)."""
    return np.stack(
        [sum(signal.fftconvolve(noise[:, axis], tap)[: len(noise)] for axis, tap in enumerate(own)) for own in taps],
        axis=1,
    )


def _unexplained(vehicle: Vehicle, robot: Robot, sending: Sending, taps: Floats, draw: np.random.Generator) -> Motion:
    """A run of the robot that plays `sending` all the time, without what its noise explains."""
    axes, scheme = vehicle.kind.axes, sending.codebook.scheme
    track = sent_track("robot", vehicle, [sending], _RUN_S, draw, robot)
    motion = axis_motion(track, axes, scheme.band_hz[1], body=vehicle.kind.has_heading)
    grid_s = np.arange(motion.start_s - TAIL_S, motion.start_s + _RUN_S + 1.0, STEP_S)
    moved = travelled(_responded(taps, sending.noise(grid_s)))
    edges_s = motion.start_s + np.arange(len(motion.seen) + 1) * motion.step_s
    places_s = np.concatenate([grid_s, [grid_s[-1] + STEP_S]])
    explained = np.diff([np.interp(edges_s, places_s, own) for own in moved], axis=1) / motion.step_s
    return Motion(motion.start_s, motion.step_s, motion.velocities - explained, motion.seen)
