"""The whitened motion correlated with every tone at every instant: what all candidates of all codebooks share."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from mtm_audit.detectors.matched.candidates import Tones
from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE, log_sum_exp
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel, power_response, whitened
from mtm_audit.detectors.matched.plants import MEMORY_S, TAIL_S, plant_family, tone_responses
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# Candidates times lags of one computation.
_MOST_CORRELATED = 1 << 18

# What robots are taken for, and one that follows half as fast. How late each is, starts take up.
_TYPICAL = plant_family(np.array([0.07]), np.array([0.14]))
_SLOWER = plant_family(np.array([0.07]), np.array([0.28]))


@dataclass(frozen=True)
class Prepared:
    """A motion made ready for correlation.

    `filtered` (observed axes, n): whitened, weighted and whitened backwards, in units of the noise; `weights`
    (observed axes, n), `scales` (observed axes,) and `noise_filters` (observed axes, order + 1) as in the noise model.
    """

    motion: Motion
    filtered: Floats
    weights: Floats
    scales: Floats
    noise_filters: Floats


def prepare(motion: Motion, noise: NoiseModel, observation: int) -> Prepared:
    """Whiten, weight, and whiten backwards (the adjoint), so that correlating with a plain template is matched."""
    filters, weights, scales = noise.filters[observation], noise.weights[observation], noise.scales[observation]
    order = noise.order
    errors = whitened(motion.velocities, filters) * weights[:, order:] / scales[:, None]
    silent = np.zeros((len(errors), order))
    filtered = whitened(np.concatenate([silent, errors[:, ::-1], silent], axis=1), filters)[:, ::-1]
    return Prepared(motion, filtered, weights, scales, filters)


@dataclass(frozen=True)
class Heard:
    """The motion correlated with each tone at each lag, at one rate; the same for every codebook.

    `projections` (observed axes, 2 K, lags): real and imaginary parts; `tones_hz` (K,); `steady` (observed axes,
    2 K) power of each tone's whitened response in a cell; `spread` (2 K,) variance of a candidate's tones over keys;
    `seen` (observed axes, lags) weight of the cells that a window starting there would have, `cells` of them at most.
    Lag 0 is `lead` cells before the recording.
    """

    projections: NDArray[np.float32]
    tones_hz: Floats
    steady: Floats
    spread: Floats
    seen: Floats
    cells: int


def hear(
    prepared: Prepared, codebook: Codebook, channel: Channel, rate_hz: float, lead: int, *, slower: bool = False
) -> Heard:
    """Correlate at one candidate rate, by the typical plant or a `slower` one.

    Of the codebook only its scheme matters.
    """
    motion, ticks = prepared.motion, codebook.scheme.window_ticks(channel)
    length_s = ticks / rate_hz
    tones_hz = codebook.bins(channel) * (rate_hz / ticks)
    cells = int(np.ceil((length_s + TAIL_S) / motion.step_s))
    count = len(motion.seen)
    lags = count + lead
    size = fft.next_fast_len(count + lead + cells)
    kernel, settled = _kernel(tuple(tones_hz.tolist()), cells, motion.step_s, length_s, size, slower)
    shifted = np.zeros((len(prepared.filtered), size), dtype=np.float32)
    shifted[:, lead : lead + count] = prepared.filtered
    # Correlation: the sum over cells of shifted[lag + cell] times response[cell].
    crossed = fft.fft(shifted, axis=-1)[:, None] * kernel[None]
    heard = fft.ifft(crossed, axis=-1, overwrite_x=True)[..., cells - 1 : cells - 1 + lags]
    projections = np.concatenate([heard.real, heard.imag], axis=1)
    weights = np.zeros((len(prepared.weights), size))
    weights[:, lead : lead + count] = prepared.weights
    steady = settled * power_response(prepared.noise_filters, tones_hz * motion.step_s)
    seen = np.maximum(_moving_sum(weights, cells)[:, :lags], 0.0)
    powers = codebook.tone_powers(channel)
    spread = np.concatenate([powers, powers]) / len(powers)
    return Heard(projections, tones_hz, np.concatenate([steady, steady], axis=1), spread, seen, cells)


@lru_cache(maxsize=160)
def _kernel(
    tones_hz: tuple[float, ...], cells: int, step_s: float, length_s: float, size: int, slower: bool
) -> tuple[NDArray[np.complex64], Floats]:
    """Transform (K, size) of a plant's response to each tone, and its settled power (K,).

    Kept, since all bodies of a recording are searched at the same rates.
    """
    tones = np.array(tones_hz)
    plant = _SLOWER if slower else _TYPICAL
    response = tone_responses(plant, tones, (np.arange(cells) + 0.5) * step_s, length_s)[0]
    settled = tone_responses(plant, tones, np.array([MEMORY_S]), 2.0 * MEMORY_S)[0, :, 0]
    return fft.fft(response[:, ::-1].astype(np.complex64), size, axis=-1), np.abs(settled) ** 2


def _moving_sum(values: Floats, cells: int) -> Floats:
    """Sum of `cells` values from each place on, shape as the input."""
    summed = np.cumsum(
        np.concatenate([np.zeros((len(values), 1)), values, np.zeros((len(values), cells))], axis=1), axis=1
    )
    difference: Floats = summed[:, cells : cells + values.shape[1]] - summed[:, : values.shape[1]]
    return difference


def template_power(tones: Tones, heard: Heard) -> Floats:
    """Mean power of a candidate's whitened template in a fully seen cell, (observed axes, axes); candidates differ
    little.
    """
    blocks = np.array_split(tones, -(-tones.size // _MOST_CORRELATED))
    squares = np.sum([np.sum(block * block, axis=0) for block in blocks], axis=0, dtype=np.float64)
    power: Floats = heard.steady @ (squares / len(tones)).T / 2.0
    return power


def evidence_by_lag(tones: Sequence[Sequence[Tones]], heard: Heard) -> NDArray[np.float32]:
    """Log of the mean over candidates of the evidence with gains unknown, (codebooks, numbered windows, lags).

    `tones` holds arrays (M, axes, 2 K), of as many windows for each codebook.
    """
    count, lags = len(tones[0][0]), heard.projections.shape[-1]
    sets, windows = len(tones), len(tones[0])
    result = np.empty((sets * windows, lags), dtype=np.float32)
    together = max(1, _MOST_CORRELATED // (count * lags))
    for first in range(0, len(result), together):
        several = range(first, min(first + together, len(result)))
        result[first : several.stop] = _evidence_of([tones[row // windows][row % windows] for row in several], heard)
    return result.reshape(sets, windows, lags)


def skimmed_by_lag(tones: Sequence[Sequence[Tones]], heard: Heard, every: int) -> NDArray[np.float32]:
    """About `evidence_by_lag`, computed at one in `every` lags: what lies between two of them has the larger's."""
    lags = np.arange(heard.projections.shape[-1])
    some = replace(
        heard, projections=np.ascontiguousarray(heard.projections[..., ::every]), seen=heard.seen[:, ::every]
    )
    found = evidence_by_lag(tones, some)
    below = lags // every
    above = np.minimum(-(-lags // every), found.shape[-1] - 1)
    return np.maximum(found[..., below], found[..., above])


def _evidence_of(sets: Sequence[Tones], heard: Heard) -> NDArray[np.float32]:
    """The same for sets of waveforms (M, axes, 2 K) each to (sets, lags)."""
    # Waveforms differ little in power, so that one scale serves all candidates of a set.
    powers = np.stack([template_power(tones, heard) for tones in sets])
    energy = (powers[..., None] * heard.seen[:, None]).astype(np.float32)
    scales = np.float32(0.5 * GAIN_VARIANCE) / (1.0 + np.float32(GAIN_VARIANCE) * energy)
    penalty = np.float32(0.5) * np.log1p(np.float32(GAIN_VARIANCE) * energy).sum(axis=(1, 2))
    count, lags = len(sets[0]), heard.projections.shape[-1]
    if len(sets) > 1 or count * lags <= _MOST_CORRELATED:
        found = log_sum_exp(_explained(np.stack(sets), heard, scales), axis=1)
    else:
        found = _log_total(sets[0], heard, scales[0])[None]
    return np.asarray(found - np.float32(np.log(count)) - penalty)


def _explained(tones: Tones, heard: Heard, scales: NDArray[np.float32]) -> NDArray[np.float32]:
    """What each candidate of sets (sets, M, axes, 2 K) explains of the motion at each lag, (sets, M, lags) nats;
    `scales` (sets, observed axes, axes, lags).
    """
    sets, count, axes, width = tones.shape
    total = np.zeros((sets, count, heard.projections.shape[-1]), dtype=np.float32)
    for axis in range(axes):
        flat = np.ascontiguousarray(tones[:, :, axis]).reshape(sets * count, width)
        for row, projection in enumerate(heard.projections):
            correlation = (flat @ projection).reshape(total.shape)
            correlation *= correlation
            correlation *= scales[:, row, axis, None]
            total += correlation
    return total


def _log_total(tones: Tones, heard: Heard, scales: NDArray[np.float32]) -> NDArray[np.float32]:
    """Log of the sum over candidates (M, axes, 2 K) of the exponential of what each explains, (lags,) nats; `scales`
    (observed axes, axes, lags).

    A large alphabet goes a block after the other, none of which leaves the processor's cache.
    """
    count, lags = len(tones), scales.shape[-1]
    # Scaling what was heard takes less than scaling what every candidate makes of it.
    scaled = [(axis, projection * np.sqrt(scales[row, axis]))
              for axis in range(tones.shape[1]) for row, projection in enumerate(heard.projections)]  # fmt: skip
    sums = []
    together = max(1, _MOST_CORRELATED // lags)
    totals, correlations = np.empty((2, together, lags), dtype=np.float32)
    for first in range(0, count, together):
        block = tones[first : first + together]
        total, correlation = totals[: len(block)], correlations[: len(block)]
        total[:] = 0.0
        for axis, projection in scaled:
            np.matmul(block[:, axis], projection, out=correlation)
            np.multiply(correlation, correlation, out=correlation)
            np.add(total, correlation, out=total)
        top = total.max(axis=0)
        np.subtract(total, top, out=total)
        np.exp(total, out=total)
        sums.append(top + np.log(total.sum(axis=0)))
    return log_sum_exp(np.stack(sums), axis=0)
