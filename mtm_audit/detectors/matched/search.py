"""Timing by matched filtering: which clock rate and which window phase explain the motion best.

The whitened motion is correlated once with each tone, passed through a typical plant, at every instant; candidates
are then sums over tones. Each window's evidence is folded over the recording at each rate. What counts is evidence
with unknown gains, so signs, rotations and mirrors of the camera do not matter.
"""

from collections.abc import Callable, Sequence
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


@dataclass(frozen=True)
class Found:
    """The most probable timing of one codebook, and its log evidence against a recording without its message."""

    timing: Timing
    evidence: float


def search_timings(
    codebooks: Sequence[Codebook],
    channel: Channel,
    prepared: Prepared,
    onset_s: float | None,
    progress: Callable[[float], None] | None = None,
) -> list[Found]:
    """For each codebook the best timing: rates over +-20 %, and onsets over the whole recording unless it is known.

    Under the fixed schedule the onset found is that of the first window in step with the message.
    """
    scheme, motion = codebooks[0].scheme, prepared.motion
    ticks = scheme.window_ticks(channel)
    rates_hz = candidate_rates(scheme.rate_hz, scheme.band_hz[1], ticks / scheme.rate_hz)
    lead = int(np.ceil(ticks / rates_hz[0] / motion.step_s))
    rolling = scheme.schedule == "rolling"
    windows = int(np.ceil(len(motion.seen) * motion.step_s * rates_hz[-1] / ticks)) if rolling else 1
    tones = [[_stacked_tones(codebook, channel, number) for number in range(windows)] for codebook in codebooks]
    best = [Found(Timing(motion.start_s, scheme.rate_hz), -np.inf)] * len(codebooks)
    for row, rate_hz in enumerate(rates_hz):
        if progress is not None:
            progress(row / len(rates_hz))
        heard = _hear(prepared, codebooks[0], channel, float(rate_hz), lead)
        grid = _fold_grid(prepared, scheme.rate_hz, rates_hz, float(rate_hz), ticks, lead, windows, onset_s, heard)
        for number, numbered in enumerate(tones):
            evidence = np.stack([_candidates_evidence(tone, heard) for tone in numbered])
            found = _fold(evidence, grid, motion, lead)
            if found.evidence > best[number].evidence:
                best[number] = found
    return best


def _stacked_tones(codebook: Codebook, channel: Channel, number: int) -> NDArray[np.float32]:
    tones = codebook.tones(channel, number)
    return np.concatenate([tones.real, -tones.imag], axis=-1).astype(np.float32)


@dataclass(frozen=True)
class _Heard:
    """The motion correlated with each tone at each lag, at one rate; the same for every codebook.

    `projections` (observed axes, 2 K, lags), `steady` (2 K,) power of each tone's whitened response in a cell,
    `seen` (observed axes, lags) weight of the cells a window starting there would have. Lag 0 is `lead` cells early.
    """

    projections: NDArray[np.float32]
    steady: Floats
    seen: Floats


def _hear(prepared: Prepared, codebook: Codebook, channel: Channel, rate_hz: float, lead: int) -> _Heard:
    motion, ticks = prepared.motion, codebook.scheme.window_ticks(channel)
    length_s = ticks / rate_hz
    tones_hz = codebook.bins(channel) * (rate_hz / ticks)
    cells = int(np.ceil((length_s + TAIL_S) / motion.step_s))
    response = tone_responses(_TYPICAL, tones_hz, (np.arange(cells) + 0.5) * motion.step_s, length_s)[0]
    count = len(motion.seen)
    lags = count + lead
    size = fft.next_fast_len(count + lead + cells)
    shifted = np.zeros((len(prepared.filtered), size))
    shifted[:, lead : lead + count] = prepared.filtered
    # Correlation: the sum over cells of shifted[lag + cell] times response[cell].
    kernel = fft.fft(response[:, ::-1], size, axis=-1)
    crossed = fft.fft(shifted, axis=-1)[:, None] * kernel[None]
    heard = fft.ifft(crossed, axis=-1)[..., cells - 1 : cells - 1 + lags]
    projections = np.concatenate([heard.real, heard.imag], axis=1).astype(np.float32)
    weights = np.zeros((len(prepared.weights), size))
    weights[:, lead : lead + count] = prepared.weights
    settled = tone_responses(_TYPICAL, tones_hz, np.array([MEMORY_S]), 2.0 * MEMORY_S)[0, :, 0]
    steady = np.abs(settled) ** 2 * power_response(prepared.noise_filter, tones_hz * motion.step_s)
    return _Heard(projections, np.concatenate([steady, steady]), np.maximum(_moving_sum(weights, cells)[:, :lags], 0.0))


def _moving_sum(values: Floats, cells: int) -> Floats:
    """Sum of `cells` values from each place on, shape as the input."""
    summed = np.cumsum(
        np.concatenate([np.zeros((len(values), 1)), values, np.zeros((len(values), cells))], axis=1), axis=1
    )
    difference: Floats = summed[:, cells : cells + values.shape[1]] - summed[:, : values.shape[1]]
    return difference


def _candidates_evidence(tones: NDArray[np.float32], heard: _Heard) -> Floats:
    """Log of the mean over candidates of the evidence with gains unknown: `tones` (M, axes, 2 K) to (lags,)."""
    count, axes = tones.shape[:2]
    total = np.zeros((count, heard.projections.shape[-1]), dtype=np.float32)
    penalty = np.zeros(total.shape[1])
    for axis in range(axes):
        # Mean power of a candidate's whitened template in a fully seen cell; candidates differ little in it.
        power = float(np.mean((tones[:, axis] ** 2) @ heard.steady)) / 2.0
        for projection, seen in zip(heard.projections, heard.seen, strict=True):
            energy = power * seen
            correlation = tones[:, axis] @ projection
            correlation *= correlation
            correlation *= (0.5 * GAIN_VARIANCE / (1.0 + GAIN_VARIANCE * energy)).astype(np.float32)
            total += correlation
            penalty += 0.5 * np.log1p(GAIN_VARIANCE * energy)
    evidence: Floats = log_sum_exp(total, axis=0) - np.log(count) - penalty
    return evidence


@dataclass(frozen=True)
class _FoldGrid:
    """Where the windows of each hypothesis lie: `places` (fine rates, starts, windows) lags, `inside` which of them
    exist, `rows` (windows,) whose evidence each takes, `prior` (fine rates,) log prior of the rates.
    """

    fine_rates_hz: Floats
    starts: Floats
    places: NDArray[np.int64]
    inside: NDArray[np.bool_]
    rows: NDArray[np.int64]
    prior: Floats


def _fold_grid(
    prepared: Prepared,
    nominal_hz: float,
    rates_hz: Floats,
    rate_hz: float,
    ticks: int,
    lead: int,
    numbered: int,
    onset_s: float | None,
    heard: _Heard,
) -> _FoldGrid:
    motion, lags = prepared.motion, heard.projections.shape[-1]
    spacing = (rates_hz[1] - rates_hz[0]) / nominal_hz
    fine = max(1, int(np.ceil(spacing * len(motion.seen) * motion.step_s / (2.0 * _DRIFT_S))))
    fine_rates_hz = rate_hz * (1.0 + np.arange(-fine, fine + 1) / (2 * fine + 1) * spacing)
    lengths = ticks / fine_rates_hz / motion.step_s
    rolling = numbered > 1
    if onset_s is not None:
        starts = np.array([(onset_s - motion.start_s) / motion.step_s + lead])
    else:
        starts = np.arange(lags if rolling else int(np.ceil(lengths.max())), dtype=np.float64)
    windows = numbered if rolling else int(np.ceil(lags / lengths.min())) + 1
    numbers = np.arange(windows)
    places = np.rint(starts[None, :, None] + numbers * lengths[:, None, None]).astype(np.int64)
    inside = (places >= 0) & (places < lags)
    prior = -np.log1p(((fine_rates_hz / nominal_hz - 1.0) / _USUAL_RATE_ERROR) ** 2)
    rows = numbers if rolling else np.zeros(windows, dtype=np.int64)
    return _FoldGrid(fine_rates_hz, starts, np.clip(places, 0, lags - 1), inside, rows, prior)


def _fold(evidence: Floats, grid: _FoldGrid, motion: Motion, lead: int) -> Found:
    """Add up the windows' evidence (numbered windows, lags) at every hypothesis, and take the best."""
    # A window either carries the message or is silent, even odds: a recording may hold more than the message.
    carried = np.logaddexp(0.0, evidence) - np.log(2.0)
    totals = np.where(grid.inside, carried[grid.rows, grid.places], 0.0).sum(axis=2) + grid.prior[:, None]
    row, column = np.unravel_index(np.argmax(totals), totals.shape)
    onset_s = motion.start_s + (float(grid.starts[column]) - lead) * motion.step_s
    return Found(Timing(onset_s, float(grid.fine_rates_hz[row])), float(totals[row, column]))
