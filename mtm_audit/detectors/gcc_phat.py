"""Onset and rate of a message by generalised cross-correlation with phase transform (GCC-PHAT), as in the paper."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from mtm_audit.model.glimpse import Glimpse, tick_velocities
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.spectrum import Points, tone_powers

# The paper's grid of candidate policy rates: 101 over +-20 %.
RATE_SCALES: Floats = np.linspace(0.8, 1.2, 101)


@dataclass(frozen=True)
class PhatPlan:
    """What the onset search needs of a glimpse, whatever the candidate waveforms are.

    `phases` (rates, axes, frequencies): unit-magnitude spectra of the tick velocities at each candidate rate, each
    frequency times what it counts, which is nothing outside the band; `ticks` (rates,) the recording's length in
    control periods, at least one; `transform_ticks` the length of the transforms. Single precision: only the place of a
    peak is read from them.
    """

    first_s: float
    rates_hz: Floats
    ticks: NDArray[np.int64]
    transform_ticks: int
    phases: NDArray[np.complex64]


def plan_onset_search(
    glimpse: Glimpse, rates_hz: Floats, band_of_rate: Floats, window_ticks: int, spectrum: Points | None = None
) -> PhatPlan:
    """Prepare a generalised cross-correlation with phase transform (GCC-PHAT) at each candidate rate.

    `band_of_rate` is (low, high) as fractions of the rate, as are the frequencies of the `spectrum`, in proportion to
    whose power those of the band count; without one all count alike.
    """
    first_s, last_s = float(glimpse.edges_s[0]), float(glimpse.edges_s[-1])
    ticks = np.maximum(1, np.floor((last_s - first_s) * rates_hz + 1e-6).astype(np.int64))
    transform_ticks = fft.next_fast_len(int(ticks.max()) + window_ticks, real=True)
    frequencies = np.fft.rfftfreq(transform_ticks)
    inside = (frequencies >= band_of_rate[0]) & (frequencies <= band_of_rate[1])
    counted = inside.astype(np.float64)
    if spectrum is not None:
        counted[inside] = tone_powers(spectrum, frequencies[inside])
    phases = np.zeros((len(rates_hz), glimpse.velocities.shape[1], len(frequencies)), dtype=np.complex64)
    for row, (rate_hz, count) in enumerate(zip(rates_hz, ticks, strict=True)):
        velocities = tick_velocities(glimpse, first_s, float(rate_hz), int(count))
        phases[row] = _unit(fft.rfft(velocities - velocities.mean(axis=0), transform_ticks, axis=0).T) * counted
    return PhatPlan(first_s, rates_hz, ticks, transform_ticks, phases)


def find_onset(plan: PhatPlan, references: list[Floats], positions: int, window_ticks: int) -> Timing:
    """The onset and rate at which the references' GCC-PHAT peaks add up highest.

    `references`: arrays (M, axes, window_ticks), one for each of the message's symbol positions, or a single one that
    serves them all. At each lag the best candidate of each position counts, and the positions are added at their
    distances. Only onsets with the whole message inside the recording are considered (the first instant alone when
    the recording is shorter than that).
    """
    peaks = [_best_candidate(plan, reference) for reference in references]
    onsets = np.maximum(1, plan.ticks - positions * window_ticks + 1)
    total = np.zeros((len(plan.rates_hz), int(onsets.max())), dtype=np.float32)
    for position in range(positions):
        peak = peaks[position % len(peaks)]
        lags = (np.arange(total.shape[1]) + position * window_ticks) % plan.transform_ticks
        total += peak[:, lags]
    total[np.arange(total.shape[1])[None, :] >= onsets[:, None]] = -np.inf
    rate, lag = np.unravel_index(np.argmax(total), total.shape)
    rate_hz = float(plan.rates_hz[rate])
    return Timing(plan.first_s + float(lag) / rate_hz, rate_hz)


def find_onset_within(plan: PhatPlan, references: list[Floats], bounds: OnsetRange, window_ticks: int) -> Timing:
    """The onset within bounds, and the rate, at which the GCC-PHAT peaks of all numbered windows add up highest.

    `references`: arrays (M, axes, window_ticks) of window 0, 1, ... from the onset on; those that lie wholly inside
    the recording count, each by how far its best candidate stands above the usual.
    """
    first = np.floor((bounds.low_s - plan.first_s) * plan.rates_hz).astype(np.int64)
    count = int(np.ceil((bounds.high_s - bounds.low_s) * plan.rates_hz.max())) + 1
    onsets = first[:, None] + np.arange(count)
    rows = np.arange(len(plan.rates_hz))[:, None]
    total = np.zeros(onsets.shape, dtype=np.float32)
    for window, reference in enumerate(references):
        lags = onsets + window * window_ticks
        inside = (lags >= 0) & (lags <= (plan.ticks - window_ticks)[:, None])
        if inside.any():
            peaks = _best_candidate(plan, reference)
            excess = peaks - np.median(peaks, axis=1, keepdims=True)
            total += np.where(inside, excess[rows, np.clip(lags, 0, plan.transform_ticks - 1)], np.float32(0.0))
    rate, place = np.unravel_index(np.argmax(total), total.shape)
    rate_hz = float(plan.rates_hz[rate])
    return Timing(plan.first_s + float(onsets[rate, place]) / rate_hz, rate_hz)


def _best_candidate(plan: PhatPlan, reference: Floats) -> NDArray[np.float32]:
    """GCC-PHAT of the best of M candidates at each rate and lag: (M, axes, window_ticks) to (rates, lags)."""
    spectra = _unit(fft.rfft(reference, plan.transform_ticks, axis=-1).conj()).astype(np.complex64)
    best = np.full((len(plan.rates_hz), plan.transform_ticks), -np.inf, dtype=np.float32)
    for spectrum in spectra:
        crossed = np.einsum("af,raf->rf", spectrum, plan.phases)
        np.maximum(best, fft.irfft(crossed, plan.transform_ticks, axis=-1), out=best)
    return best


def _unit(spectrum: NDArray[np.complex128]) -> NDArray[np.complex128]:
    magnitude = np.abs(spectrum)
    # What is silent next to the loudest is numerical dust; it keeps no phase.
    floor = max(1e-9 * float(magnitude.max()), 1e-300)
    unit: NDArray[np.complex128] = spectrum / np.maximum(magnitude, floor)
    return unit
