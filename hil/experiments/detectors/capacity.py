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
    step_s = silences[0].step_s
    measured_hz, _ = welch(silences[0].velocities, 1.0 / step_s, nperseg=_SEGMENT_BINS)
    frequencies_hz = np.linspace(*band_hz, _FREQUENCIES)
    mean = np.mean([_spectrum(motion) for motion in silences], axis=0)
    interference = np.array([np.interp(frequencies_hz, measured_hz, axis) for axis in mean])
    # A sum of evenly spaced tones in the band, held over each tick, lagged, and averaged over each time bin.
    sent = sigma**2 / (band_hz[1] - band_hz[0])
    gain = _gain(plant, rate_hz, step_s, frequencies_hz)
    return frequencies_hz, sent * gain / interference


def _spectrum(motion: Motion) -> Floats:
    """One-sided power density of each axis, (axes, frequencies)."""
    density: Floats = welch(motion.velocities, 1.0 / motion.step_s, nperseg=_SEGMENT_BINS)[1]
    return density


def _gain(plant: MecanumParameters, rate_hz: float, step_s: float, frequencies_hz: Floats) -> Floats:
    held, averaged = np.sinc(frequencies_hz / rate_hz), np.sinc(frequencies_hz * step_s)
    gain: Floats = (held * averaged) ** 2 / (1.0 + (2.0 * np.pi * frequencies_hz * plant.lag_s) ** 2)
    return gain
