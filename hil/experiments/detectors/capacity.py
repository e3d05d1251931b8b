"""Shannon's bound on what one robot could send through the plant against the interference that was measured.

This is the capacity of a band-limited channel with Gaussian interference; the paper's capacity (`eq:capacity`, Section
"Approximate Multi-Channel Symbol Allocation") is that of an M-ary symmetric channel and stands in
`mtm_audit.planning.capacity`.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from hil.plants.mecanum import MecanumParameters
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.model.track import Floats
from mtm_audit.planning import waterfill

_SEGMENT_BINS = 64
_FREQUENCIES = 400


def capacity_bps(
    plant: MecanumParameters, sigma: float, rate_hz: float, band_hz: tuple[float, float], silences: Sequence[Motion]
) -> float:
    """Bits per second of one robot over all its axes, with the power of `sigma` (m/s) spread evenly over the band.

    `silences` are motions without a message. The interference is taken as Gaussian and stationary with their mean
    spectrum; a detector that makes use of times when it is weaker can exceed the bound.
    """
    _, ratios = signal_to_interference(plant, sigma, rate_hz, band_hz, silences)
    return waterfill.capacity_bps(ratios, np.ones(ratios.shape[1]), band_hz[1] - band_hz[0])


def signal_to_interference(
    plant: MecanumParameters, sigma: float, rate_hz: float, band_hz: tuple[float, float], silences: Sequence[Motion]
) -> tuple[Floats, Floats]:
    """Frequencies (K,) evenly over the band, and at each the ratio of the two densities on each axis, (axes, K)."""
    frequencies_hz = np.linspace(*band_hz, _FREQUENCIES)
    # A sum of evenly spaced tones in the band, held over each tick and lagged.
    sent = sigma**2 / (band_hz[1] - band_hz[0])
    return frequencies_hz, sent * gain(plant, rate_hz, frequencies_hz) ** 2 / motion_density(silences, frequencies_hz)


def motion_density(silences: Sequence[Motion], frequencies_hz: Floats) -> Floats:
    """One-sided power density of each axis at those frequencies, (axes, K), the mean over motions of one time step."""
    step_s = silences[0].step_s
    measured_hz, _ = welch(silences[0].velocities, 1.0 / step_s, nperseg=_SEGMENT_BINS)
    mean = np.mean([welch(own.velocities, 1.0 / step_s, nperseg=_SEGMENT_BINS)[1] for own in silences], axis=0)
    measured = np.array([np.interp(frequencies_hz, measured_hz, axis) for axis in mean])
    # Each time bin is a mean over its length.
    return np.asarray(measured / np.sinc(frequencies_hz * step_s) ** 2)


def gain(plant: MecanumParameters, rate_hz: float, frequencies_hz: Floats) -> Floats:
    """How much of noise at those frequencies the robot follows, which is held over each tick."""
    held = np.sinc(frequencies_hz / rate_hz)
    return np.asarray(held / np.sqrt(1.0 + (2.0 * np.pi * frequencies_hz * plant.lag_s) ** 2))
