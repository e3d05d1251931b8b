"""The limit for detectors in a world: one that is told everything but the symbol in question.

What the noise does to the motion is learned, as a finite impulse response, from rollouts whose noise is known, and so
are the statistics of everything else; each window is then judged with all other windows' symbols known. Where a world
answers linearly no detector does better; where it does not, the genie knows the best linear answer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.experiments.detectors.genie import ORDER, Interference, fit_interference, log_likelihoods
from hil.experiments.worlds.reading import Seen
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import whitened
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, Codebook

GENIE = "genie"
_MEMORY_S = 1.0
_ROUNDS = 2
_RIDGE = 1e-4


@dataclass(frozen=True)
class Knowledge:
    """`taps` (observed axes, injected axes, ticks of memory), newest tick first; `interference` is all the rest."""

    taps: Floats
    interference: Interference


@dataclass(frozen=True)
class Lesson:
    """One shot of one channel's body and the noise that it was under, (ticks, injected axes), in the command's unit."""

    motion: Motion
    noise: Floats
    rate_hz: float


def lessons(codebook: Codebook, seen: Sequence[Seen], sent: Sequence[Sequence[int]]) -> list[list[Lesson]]:
    """Of each channel one for each shot; `sent` are the symbols of each message, the same on all channels."""
    scheme = codebook.scheme
    found = []
    for channel in scheme.channels:
        noise = np.concatenate(list(_played(codebook, channel, [symbol for message in sent for symbol in message])))
        found.append(
            [
                Lesson(
                    uniform_motion(shot.glimpses[channel.body], scheme.band_hz[1]),
                    noise[shot.ticks.start : shot.ticks.stop],
                    scheme.rate_hz,
                )
                for shot in seen
            ]
        )
    return found


def learn(examples: Sequence[Lesson]) -> Knowledge:
    """Fit response and interference to lessons, by generalised least squares."""
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
    return Knowledge(taps.reshape(observed, injected, memory), interference)


def genie_scores(
    knowledge: Knowledge, codebook: Codebook, own: Sequence[Lesson], seen: Sequence[Seen], channel: Channel
) -> Floats:
    """Log-likelihoods (windows, M) of each window of one channel in a row."""
    observed, injected, memory = knowledge.taps.shape
    flat = knowledge.taps.reshape(observed, injected * memory)
    ticks = codebook.scheme.window_ticks(channel)
    candidates = channel.sigma * codebook.samples(channel, 0).transpose(0, 2, 1)
    scores = []
    for lesson, shot in zip(own, seen, strict=True):
        length = len(shot.ticks)
        rest = _without(lesson.motion, flat @ _design(lesson, memory))
        for start in range(0, length, ticks):
            silent = np.zeros((length, injected))
            played = silent.copy()
            played[start : start + ticks] = lesson.noise[start : start + ticks]
            cells = _heard(lesson, start, ticks + memory)
            alone = _motion_of(lesson, played, flat)[:, cells]
            tried = []
            for candidate in candidates:
                silent[start : start + ticks] = candidate
                tried.append(_motion_of(lesson, silent, flat)[:, cells])
            residual = rest.velocities[:, cells] + alone
            scores.append(log_likelihoods(residual, np.array(tried), knowledge.interference))
    return np.array(scores)


def _played(codebook: Codebook, channel: Channel, symbols: Sequence[int]) -> list[Floats]:
    waveforms = codebook.samples(channel, 0)
    return [channel.sigma * waveforms[symbol].T for symbol in symbols]


def _cell_ticks(lesson: Lesson) -> int:
    return round(lesson.motion.step_s * lesson.rate_hz)


def _design(lesson: Lesson, memory: int) -> Floats:
    """Noise of the last `memory` ticks at the end of each cell, newest first: (injected axes * memory, cells)."""
    padded = np.concatenate([np.zeros((memory, lesson.noise.shape[1])), lesson.noise])
    ends = (np.arange(len(lesson.motion.seen)) + 1) * _cell_ticks(lesson)
    rows = np.minimum(ends[None, :] + memory - 1 - np.arange(memory)[:, None], len(padded) - 1)
    design: Floats = padded[rows].transpose(2, 0, 1).reshape(-1, len(ends))
    return design


def _motion_of(lesson: Lesson, noise: Floats, taps: Floats) -> Floats:
    memory = taps.shape[1] // noise.shape[1]
    return np.asarray(taps @ _design(Lesson(lesson.motion, noise, lesson.rate_hz), memory))


def _heard(lesson: Lesson, start_tick: int, ticks: int) -> slice:
    """The cells that hear these ticks, with as many before as the whitening filter takes."""
    size = _cell_ticks(lesson)
    return slice(max(0, start_tick // size - ORDER), min(len(lesson.motion.seen), -(-(start_tick + ticks) // size)))


def _without(motion: Motion, expected: Floats) -> Motion:
    return Motion(motion.start_s, motion.step_s, motion.velocities - expected, motion.seen)


def _solved(examples: Sequence[Lesson], designs: Sequence[Floats], whitening: Floats) -> Floats:
    width = len(designs[0])
    normal = np.zeros((width, width))
    right = np.zeros((width, len(examples[0].motion.velocities)))
    for example, design in zip(examples, designs, strict=True):
        columns, seen = whitened(design, whitening), whitened(example.motion.velocities, whitening)
        normal += columns @ columns.T
        right += columns @ seen.T
    normal += np.eye(width) * np.trace(normal) / width * _RIDGE
    return np.asarray(np.linalg.solve(normal, right).T)
