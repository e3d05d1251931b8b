"""The genie of `hil.experiments.detectors.genie`, an oracle detector, for worlds whose plant has no formula.

The response of the motion to the noise is fitted, as a finite impulse response, to rollouts whose noise is known, and
so are the statistics of everything else; each window is then decided with all other windows' symbols given. It is the
limit for any detector where a world responds linearly; where it does not, the genie has the best linear fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.experiments.detectors.genie import ORDER, Interference, fit_interference, log_likelihoods
from hil.experiments.worlds.reading import ObservedShot
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import whitened
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, Codebook

GENIE = "genie"
_MEMORY_S = 1.0
_ROUNDS = 2
_RIDGE = 1e-4


@dataclass(frozen=True)
class GenieModel:
    """What is fitted to rollouts on which nothing is measured.

    `taps` (observed axes, injected axes, ticks of memory): impulse response, newest tick first; `interference`: the
    statistics of what remains of the motion.
    """

    taps: Floats
    interference: Interference


@dataclass(frozen=True)
class KnownShot:
    """One shot with known noise: a body's motion, and `noise` (ticks, injected axes) in the command's unit."""

    motion: Motion
    noise: Floats
    rate_hz: float


def known_shots(
    codebook: Codebook, seen: Sequence[ObservedShot], sent: Sequence[Sequence[int]]
) -> list[list[KnownShot]]:
    """For each channel one entry a shot; `sent` are each message's symbols, the same on all channels."""
    scheme = codebook.scheme
    found = []
    for channel in scheme.channels:
        noise = np.concatenate(list(_played(codebook, channel, [symbol for message in sent for symbol in message])))
        found.append(
            [
                KnownShot(
                    uniform_motion(shot.glimpses[channel.body], scheme.band_hz[1]),
                    noise[shot.ticks.start : shot.ticks.stop],
                    scheme.rate_hz,
                )
                for shot in seen
            ]
        )
    return found


def fit_genie(examples: Sequence[KnownShot]) -> GenieModel:
    """Response and interference, fitted by generalised least squares."""
    first = examples[0]
    memory = round(_MEMORY_S * first.rate_hz)
    designs = [_design(example, memory) for example in examples]
    observed, injected = len(first.motion.velocities), first.noise.shape[1]
    whitening = np.concatenate([[1.0], np.zeros(ORDER)])
    taps: Floats = np.zeros((observed, injected * memory))
    for _ in range(_ROUNDS):
        taps = _solved(examples, designs, whitening)
        rests = [_without(example.motion, taps @ design) for example, design in zip(examples, designs, strict=True)]
        interference = fit_interference(rests)
        whitening = interference.filter
    return GenieModel(taps.reshape(observed, injected, memory), interference)


def genie_scores(
    model: GenieModel,
    codebook: Codebook,
    own: Sequence[KnownShot],
    seen: Sequence[ObservedShot],
    channel: Channel,
) -> Floats:
    """(windows, M): log-likelihoods, nats, of one channel's windows in order."""
    observed, injected, memory = model.taps.shape
    flat = model.taps.reshape(observed, injected * memory)
    ticks = codebook.scheme.window_ticks(channel)
    candidates = np.array(channel.sigmas) * codebook.samples(channel, 0).transpose(0, 2, 1)
    scores = []
    for known, shot in zip(own, seen, strict=True):
        length = len(shot.ticks)
        rest = _without(known.motion, flat @ _design(known, memory))
        for start in range(0, length, ticks):
            silent = np.zeros((length, injected))
            played = silent.copy()
            played[start : start + ticks] = known.noise[start : start + ticks]
            bins = _affected_bins(known, start, ticks + memory)
            alone = _motion_of(known, played, flat)[:, bins]
            tried = []
            for candidate in candidates:
                silent[start : start + ticks] = candidate
                tried.append(_motion_of(known, silent, flat)[:, bins])
            residual = rest.velocities[:, bins] + alone
            scores.append(log_likelihoods(residual, np.array(tried), model.interference))
    return np.array(scores)


def _played(codebook: Codebook, channel: Channel, symbols: Sequence[int]) -> list[Floats]:
    waveforms = codebook.samples(channel, 0)
    return [np.array(channel.sigmas) * waveforms[symbol].T for symbol in symbols]


def _bin_ticks(known: KnownShot) -> int:
    return round(known.motion.step_s * known.rate_hz)


def _design(known: KnownShot, memory: int) -> Floats:
    """(injected axes * memory, bins): noise of the last `memory` ticks at the end of each time bin, newest first."""
    padded = np.concatenate([np.zeros((memory, known.noise.shape[1])), known.noise])
    ends = (np.arange(len(known.motion.seen)) + 1) * _bin_ticks(known)
    rows = np.minimum(ends[None, :] + memory - 1 - np.arange(memory)[:, None], len(padded) - 1)
    design: Floats = padded[rows].transpose(2, 0, 1).reshape(-1, len(ends))
    return design


def _motion_of(known: KnownShot, noise: Floats, taps: Floats) -> Floats:
    memory = taps.shape[1] // noise.shape[1]
    return np.asarray(taps @ _design(KnownShot(known.motion, noise, known.rate_hz), memory))


def _affected_bins(known: KnownShot, start_tick: int, ticks: int) -> slice:
    """The time bins that respond to these ticks, with as many before them as the whitening filter needs."""
    size = _bin_ticks(known)
    return slice(max(0, start_tick // size - ORDER), min(len(known.motion.seen), -(-(start_tick + ticks) // size)))


def _without(motion: Motion, expected: Floats) -> Motion:
    return Motion(motion.start_s, motion.step_s, motion.velocities - expected, motion.seen)


def _solved(examples: Sequence[KnownShot], designs: Sequence[Floats], whitening: Floats) -> Floats:
    width = len(designs[0])
    normal = np.zeros((width, width))
    right = np.zeros((width, len(examples[0].motion.velocities)))
    for example, design in zip(examples, designs, strict=True):
        columns, seen = whitened(design, whitening), whitened(example.motion.velocities, whitening)
        normal += columns @ columns.T
        right += columns @ seen.T
    normal += np.eye(width) * np.trace(normal) / width * _RIDGE
    return np.asarray(np.linalg.solve(normal, right).T)
