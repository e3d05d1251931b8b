"""A linear response and an interference that fit measured spectra."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, nnls

from hil.experiments.identify.spectra import RATE_HZ, CrossSpectra
from hil.plants.interference import slip_density
from hil.plants.linear_response import LinearResponse
from mtm_audit.model.track import Floats

LOWEST_HZ, HIGHEST_HZ = 0.3, 4.0
_CORRELATIONS_S = np.geomspace(0.02, 3.0, 40)
# The task below this moves the robot in ways that commands of few levels do not show.
_QUIET_HZ = 0.3


@dataclass(frozen=True)
class FittedInterference:
    """Noise of standard deviation `deviation` (m/s or rad/s) whose correlation falls exponentially in `correlation_s`,
    apart from what the tracking adds, `tracking` (m or rad, standard deviation of one observed position in a bin).
    """

    deviation: float
    correlation_s: float
    tracking: float


def phase_delay_s(spectra: CrossSpectra) -> float:
    """The delay by the phase's slope over frequencies of coherence above 0.3; NaN with fewer than four of these."""
    use = (spectra.frequencies_hz > LOWEST_HZ) & (spectra.frequencies_hz <= HIGHEST_HZ) & (spectra.coherence > 0.3)
    if np.count_nonzero(use) < 4:
        return float("nan")
    phase = np.unwrap(np.angle(spectra.gain[use]))
    return float(-np.polyfit(spectra.frequencies_hz[use], phase, 1)[0] / (2.0 * np.pi))


def fit_response(spectra: CrossSpectra) -> LinearResponse:
    """The delay with a lag, or else with an oscillator, that is likelier for the measured gains (least squares).

    Each frequency counts by the variance that a gain of its coherence has. The oscillator has a parameter more and must
    pay for it (Akaike).
    """
    frequencies, coherence = spectra.frequencies_hz, spectra.coherence
    # Without any connection the coherence is 1 / segments on the average.
    use = (frequencies >= LOWEST_HZ) & (frequencies <= HIGHEST_HZ) & (coherence > 3.0 / spectra.segments)
    used_hz = np.asarray(frequencies[use], dtype=np.float64)
    gain, coherence = spectra.gain[use], np.minimum(coherence[use], 0.99)
    spread = np.abs(gain) * np.sqrt((1.0 - coherence) / (2.0 * spectra.segments * coherence))

    def misfit(values: Floats, make: type[_Lag] | type[_Oscillator]) -> Floats:
        off = (make.response(values).at(used_hz) - gain) / spread
        return np.concatenate([off.real, off.imag])

    fits = []
    for make in (_Lag, _Oscillator):
        for delay_s in (0.05, 0.15, 0.3):
            found = least_squares(misfit, make.start(delay_s), bounds=make.bounds, args=(make,), loss="soft_l1")
            fits.append((2.0 * found.cost + 2.0 * len(found.x), make.response(found.x)))
    return min(fits, key=lambda fit: fit[0])[1]


class _Lag:
    """Log gain, delay, log lag."""

    bounds = ([-3.0, 0.0, np.log(0.01)], [1.5, 0.6, np.log(2.0)])

    @staticmethod
    def start(delay_s: float) -> list[float]:
        return [-0.1, delay_s, np.log(0.15)]

    @staticmethod
    def response(values: Floats) -> LinearResponse:
        return LinearResponse(gain=float(np.exp(values[0])), delay_s=float(values[1]), lag_s=float(np.exp(values[2])))


class _Oscillator:
    """Log gain, delay, log natural frequency, damping ratio."""

    bounds = ([-3.0, 0.0, np.log(0.3), 0.2], [1.5, 0.6, np.log(10.0), 2.0])

    @staticmethod
    def start(delay_s: float) -> list[float]:
        return [-0.1, delay_s, np.log(2.0), 0.7]

    @staticmethod
    def response(values: Floats) -> LinearResponse:
        return LinearResponse(
            gain=float(np.exp(values[0])), delay_s=float(values[1]), natural_hz=float(np.exp(values[2])),
            damping=float(values[3]),
        )  # fmt: skip


def fit_interference(spectra: CrossSpectra) -> FittedInterference:
    """Fit the unexplained power above 0.3 Hz by two terms of at least zero, each frequency in proportion to itself."""
    use = spectra.frequencies_hz >= _QUIET_HZ
    frequencies, power = np.asarray(spectra.frequencies_hz[use], dtype=np.float64), spectra.unexplained[use]
    # A difference of two positions, each with white noise of unit variance, divided by the bin's length; one-sided.
    tracking = 2.0 / RATE_HZ * (2.0 * RATE_HZ * np.sin(np.pi * frequencies / RATE_HZ)) ** 2
    best = (np.inf, FittedInterference(0.0, 0.1, 0.0))
    for correlation_s in _CORRELATIONS_S:
        slip = slip_density(1.0, correlation_s, frequencies) * np.sinc(frequencies / RATE_HZ) ** 2  # a bin's mean
        parts, misfit = nnls(np.stack([slip / power, tracking / power], axis=1), np.ones(len(power)))
        if misfit < best[0]:
            best = (
                misfit,
                FittedInterference(float(np.sqrt(parts[0])), float(correlation_s), float(np.sqrt(parts[1]))),
            )
    return best[1]
