"""The genie (see genie.py) for large alphabets, on velocities and on turning.

The candidates are compared by least squares first, which costs one product of matrices, and the best of them by
Student's t. A robot's turning follows the message through the controller that holds its heading, which the genie knows.
"""

from collections.abc import Sequence

import numpy as np

from hil.experiments.detectors.bench_recording import ONSET_S, Integers
from hil.experiments.detectors.genie import (
    Interference,
    fit_interference,
    log_likelihoods,
    responding_bins,
    step_displacement_m,
    tick_responses,
)
from hil.plants.mecanum import MecanumParameters
from hil.worlds.robomaster import HEADING_GAIN_PER_S
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import whitened
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, Codebook

_BLOCK = 8192
_TRIED = 1024
# How long the controller goes on turning back after a window's end.
_TAIL_S = 1.5


def read_genie(
    codebook: Codebook,
    kinds: Sequence[tuple[Sequence[Channel], Sequence[Motion]]],
    silences: Sequence[Sequence[Motion]],
    plant: MecanumParameters,
    sent: Integers,
) -> Integers:
    """Symbols (robots, windows) by the genie, which is given every other window's symbol."""
    windows = sent.shape[1]
    decided = np.empty_like(sent)
    learned = [fit_interference(motions) for motions in silences]
    responses = [_responses(codebook, channels[0], motions[0], plant, windows) for channels, motions in kinds]
    for robot in range(len(sent)):
        each = [(channels[robot], motions[robot]) for channels, motions in kinds]
        samples = [_samples(codebook, channel) for channel, _ in each]
        for window in range(windows):
            looked_at = [
                _Look(motion, own, window, played, sent[robot], known)
                for (_, motion), own, played, known in zip(each, responses, samples, learned, strict=True)
            ]
            rough = np.sum([look.by_squares() for look in looked_at], axis=0)
            tried = np.argpartition(-rough, min(_TRIED, len(rough)) - 1)[:_TRIED]
            scores = np.sum([look.exactly(tried) for look in looked_at], axis=0)
            decided[robot, window] = tried[np.argmax(scores)]
    return decided


def _samples(codebook: Codebook, channel: Channel) -> Floats:
    """What each symbol commands, (M, axes, ticks) in single precision, sigma included."""
    count = codebook.scheme.alphabet_size
    blocks = [range(first, min(first + _BLOCK, count)) for first in range(0, count, _BLOCK)]
    sigmas = np.array(channel.sigmas)[:, None]
    return np.concatenate([(sigmas * codebook.samples(channel, 0, block)).astype(np.float32) for block in blocks])


def _responses(
    codebook: Codebook, channel: Channel, motion: Motion, plant: MecanumParameters, windows: int
) -> list[Floats]:
    """For each window (bins, ticks): motion in each time bin for a command of 1 held over one tick."""
    scheme = codebook.scheme
    ticks, rate_hz = scheme.window_ticks(channel), scheme.rate_hz
    turning = channel.axes == ("wz",)
    longer = ticks + round(_TAIL_S * rate_hz) if turning else ticks
    found = []
    for window in range(windows):
        open_loop = tick_responses(plant, ONSET_S + window * ticks / rate_hz, rate_hz, longer, motion)
        found.append((open_loop @ _held(plant, longer, rate_hz))[:, :ticks] if turning else open_loop)
    return found


def _held(plant: MecanumParameters, ticks: int, rate_hz: float) -> Floats:
    """(ticks, ticks): what is commanded at each tick for noise of 1 at one, by a controller that holds the heading."""
    since_s = (np.arange(ticks)[:, None] - np.arange(ticks)) / rate_hz
    turned = step_displacement_m(plant, since_s) - step_displacement_m(plant, since_s - 1.0 / rate_hz)
    return np.asarray(np.linalg.inv(np.eye(ticks) + HEADING_GAIN_PER_S * turned))


class _Look:
    """One window of one robot on one kind of axes."""

    def __init__(
        self, motion: Motion, responses: Sequence[Floats], window: int, played: Floats, sent: Integers,
        interference: Interference,
    ) -> None:  # fmt: skip
        others = [played[symbol] @ own.T for number, (symbol, own) in enumerate(zip(sent, responses, strict=True))
                  if number != window]  # fmt: skip
        bins = responding_bins(responses[window])
        self._residual = (motion.velocities - np.sum(others, axis=0))[:, bins]
        self._response = responses[window][bins]
        self._played, self._interference = played, interference

    def by_squares(self) -> Floats:
        """(M,): log-likelihoods for Gaussian innovations."""
        known = self._interference
        # Along time, so that the whitened motion of a candidate is its samples times this.
        shape = whitened(self._response.T, known.filter).astype(np.float32)
        total = np.zeros(len(self._played))
        for axis, (row, scale) in enumerate(zip(whitened(self._residual, known.filter), known.scales, strict=True)):
            candidates = self._played[:, axis]
            total += candidates @ (shape @ row.astype(np.float32)) / scale**2
            total -= 0.5 * np.einsum("mt,mt->m", candidates @ (shape @ shape.T), candidates) / scale**2
        return total

    def exactly(self, symbols: Integers) -> Floats:
        """(symbols,): log-likelihoods for innovations by Student's t."""
        candidates = self._played[symbols].astype(np.float64) @ self._response.T
        return log_likelihoods(self._residual, candidates, self._interference)
