"""Timing by matched filtering: which clock rate and which window phase explain the motion best.

The whitened motion is correlated once with each tone, passed through a typical plant, at every instant; candidates
are then sums over tones. Each window's evidence is folded over the recording at each rate. What counts is evidence
with unknown gains, so signs, rotations and mirrors of the camera do not matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE, log_sum_exp
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel, power_response, whitened
from mtm_audit.detectors.matched.plants import MEMORY_S, TAIL_S, plant_family, tone_responses
from mtm_audit.timing import Timing
from mtm_audit.tracks import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

SEARCHED_RATES = 0.2
_TYPICAL = plant_family(np.array([0.07]), np.array([0.14]))
_PHASE_ERROR_RAD = 0.6
_DRIFT_S = 0.02
# Clocks that are off by more than this are possible but rare: the scale of a Cauchy prior over relative rates.
_USUAL_RATE_ERROR = 0.003


@dataclass(frozen=True)
class Prepared:
    """A motion made ready for correlation.

    `filtered` (observed axes, n): whitened, weighted and whitened backwards, in units of the noise; `weights`
    (observed axes, n) as in the noise model, whose filter is `noise_filter`.
    """

    motion: Motion
    filtered: Floats
    weights: Floats
    noise_filter: Floats


def prepare(motion: Motion, noise: NoiseModel, observation: int) -> Prepared:
    """Whiten, weight, and whiten backwards (the adjoint), so that correlating with a plain template is matched."""
    weights, scales = noise.weights[observation], noise.scales[observation]
    order = noise.order
    errors = whitened(motion.velocities, noise.filter) * weights[:, order:] / scales[:, None]
    silent = np.zeros((len(errors), order))
    filtered = whitened(np.concatenate([silent, errors[:, ::-1], silent], axis=1), noise.filter)[:, ::-1]
    return Prepared(motion, filtered, weights, noise.filter)


def candidate_rates(rate_hz: float, highest_hz: float, window_s: float) -> Floats:
    """Rates over +-20 %, as far apart as the highest tone's phase at a window's ends allows; nominal among them."""
    step = 2.0 * _PHASE_ERROR_RAD / (np.pi * highest_hz * window_s)
    count = int(np.ceil(SEARCHED_RATES / step))
    rates: Floats = rate_hz * (1.0 + np.arange(-count, count + 1) * (SEARCHED_RATES / count))
    return rates


def search_timing(codebook: Codebook, channel: Channel, prepared: Prepared, onset_s: float | None) -> Timing:
    """The most probable timing: rates over +-20 %, and onsets over the whole recording unless `onset_s` is known.

    Under the fixed schedule the onset is that of any window in step with the message; `align_message` finds the
    message's own beginning.
    """
    scheme, motion = codebook.scheme, prepared.motion
    ticks = scheme.window_ticks(channel)
    rates_hz = candidate_rates(scheme.rate_hz, scheme.band_hz[1], ticks / scheme.rate_hz)
    duration_s = len(motion.seen) * motion.step_s
    longest_s = ticks / rates_hz[0]
    lead = int(np.ceil(longest_s / motion.step_s))
    windows = 1 if scheme.schedule == "fixed" else int(np.ceil(duration_s * rates_hz[-1] / ticks))
    tones = [_stacked_tones(codebook, channel, number) for number in range(windows)]
    best, best_score = Timing(motion.start_s if onset_s is None else onset_s, scheme.rate_hz), -np.inf
    for rate_hz in rates_hz:
        evidence = _evidence_by_lag(prepared, codebook, channel, float(rate_hz), tones, lead)
        timing, score = _fold(evidence, prepared, scheme.rate_hz, float(rate_hz), rates_hz, ticks, lead, onset_s)
        if score > best_score:
            best, best_score = timing, score
    return best


def _stacked_tones(codebook: Codebook, channel: Channel, number: int) -> NDArray[np.float32]:
    tones = codebook.tones(channel, number)
    return np.concatenate([tones.real, -tones.imag], axis=-1).astype(np.float32)


def _evidence_by_lag(
    prepared: Prepared,
    codebook: Codebook,
    channel: Channel,
    rate_hz: float,
    tones: Sequence[NDArray[np.float32]],
    lead: int,
) -> Floats:
    """Log evidence (windows, lags) that a window of any symbol begins at each lag; lag 0 is `lead` cells early."""
    motion, ticks = prepared.motion, codebook.scheme.window_ticks(channel)
    length_s = ticks / rate_hz
    tones_hz = codebook.bins(channel) * (rate_hz / ticks)
    cells = int(np.ceil((length_s + TAIL_S) / motion.step_s))
    since_s = (np.arange(cells) + 0.5) * motion.step_s
    response = tone_responses(_TYPICAL, tones_hz, since_s, length_s)[0]
    count = len(motion.seen)
    lags = count + lead
    size = fft.next_fast_len(count + lead + cells)
    shifted = np.zeros((len(prepared.filtered), size))
    shifted[:, lead : lead + count] = prepared.filtered
    # Correlation: sum over cells of z[lag + cell] * response[cell].
    kernel = fft.fft(response[:, ::-1], size, axis=-1)
    spectra = fft.fft(shifted, axis=-1)
    heard = fft.ifft(spectra[:, None] * kernel[None], axis=-1)[..., cells - 1 : cells - 1 + lags]
    projections = np.concatenate([heard.real, heard.imag], axis=1).astype(np.float32)
    ones = np.zeros((len(prepared.weights), size))
    ones[:, lead : lead + count] = prepared.weights
    seen = np.maximum(_moving_sum(ones, cells)[:, :lags], 0.0)
    settled = tone_responses(_TYPICAL, tones_hz, np.array([MEMORY_S]), 2.0 * MEMORY_S)[0, :, 0]
    steady = np.abs(settled) ** 2 * power_response(prepared.noise_filter, tones_hz * motion.step_s)
    return np.stack([_candidates_evidence(tone, projections, steady, seen) for tone in tones])


def _moving_sum(values: Floats, cells: int) -> Floats:
    """Sum of `cells` values from each place on, shape as the input."""
    summed = np.cumsum(
        np.concatenate([np.zeros((len(values), 1)), values, np.zeros((len(values), cells))], axis=1), axis=1
    )
    difference: Floats = summed[:, cells : cells + values.shape[1]] - summed[:, : values.shape[1]]
    return difference


def _candidates_evidence(
    tones: NDArray[np.float32], projections: NDArray[np.float32], steady: Floats, seen: Floats
) -> Floats:
    """Log of the mean over candidates of the evidence with gains unknown: (lags,)."""
    count, axes = tones.shape[:2]
    lags = projections.shape[-1]
    total = np.zeros((count, lags), dtype=np.float32)
    penalty = np.zeros(lags)
    for axis in range(axes):
        # Mean power of a candidate's whitened template in a fully seen cell; candidates differ little in it.
        power = float(np.mean((tones[:, axis] ** 2) @ np.concatenate([steady, steady]))) / 2.0
        for observed in range(len(projections)):
            energy = power * seen[observed]
            gain = (0.5 * GAIN_VARIANCE / (1.0 + GAIN_VARIANCE * energy)).astype(np.float32)
            total += (tones[:, axis] @ projections[observed]) ** 2 * gain
            penalty += 0.5 * np.log1p(GAIN_VARIANCE * energy)
    evidence: Floats = log_sum_exp(total.astype(np.float32), axis=0) - np.log(count) - penalty
    return evidence


def _fold(
    evidence: Floats,
    prepared: Prepared,
    nominal_hz: float,
    rate_hz: float,
    rates_hz: Floats,
    ticks: int,
    lead: int,
    onset_s: float | None,
) -> tuple[Timing, float]:
    """Best onset and fine rate near one coarse rate, and its log posterior up to a constant."""
    motion = prepared.motion
    duration_s = len(motion.seen) * motion.step_s
    spacing = (rates_hz[1] - rates_hz[0]) / nominal_hz
    fine = max(1, int(np.ceil(spacing * duration_s / (2.0 * _DRIFT_S))))
    offsets = (np.arange(-fine, fine + 1) / (2 * fine + 1)) * spacing
    fine_rates_hz = rate_hz * (1.0 + offsets)
    lengths = ticks / fine_rates_hz / motion.step_s
    rolling = len(evidence) > 1
    lags = evidence.shape[1]
    # A window either carries the message or is silent, even odds: a recording may hold more than the message.
    carried = np.logaddexp(0.0, evidence) - np.log(2.0)
    if onset_s is not None:
        starts = np.array([(onset_s - motion.start_s) / motion.step_s + lead])
    elif rolling:
        starts = np.arange(lags, dtype=np.float64)
    else:
        starts = np.arange(int(np.ceil(lengths.max())), dtype=np.float64)
    windows = len(evidence) if rolling else int(np.ceil(lags / lengths.min())) + 1
    numbers = np.arange(windows)
    places = np.rint(starts[None, :, None] + numbers[None, None, :] * lengths[:, None, None]).astype(np.int64)
    inside = (places >= 0) & (places < lags)
    rows = numbers if rolling else np.zeros(windows, dtype=np.int64)
    values = np.where(inside, carried[rows[None, None, :], np.clip(places, 0, lags - 1)], 0.0)
    relative = fine_rates_hz / nominal_hz - 1.0
    totals = values.sum(axis=2) - np.log1p((relative / _USUAL_RATE_ERROR) ** 2)[:, None]
    row, column = np.unravel_index(np.argmax(totals), totals.shape)
    found_s = motion.start_s + (starts[column] - lead) * motion.step_s
    return Timing(float(found_s), float(fine_rates_hz[row])), float(totals[row, column])
