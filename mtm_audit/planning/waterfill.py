"""Water-filling: which spectrum of the noise carries most through a plant against an interference.

One waveform a channel has the same spectrum on all its axes, so the powers p_k of the tones maximise the sum over axes
and tones of log2(1 + p_k s_ak), where s_ak is the signal-to-interference ratio of an even share, at a mean of 1
(Cover and Thomas, "Elements of Information Theory", section 9.4, for one axis).
"""

import numpy as np

from mtm_audit.model.track import Floats
from mtm_onboard.protocol.spectrum import Points

# Fainter tones than this beside the loudest are not worth their part of the band.
FAINTEST_DB = -20.0
_STEPS = 60


def water_filled(ratios: Floats) -> Floats:
    """Powers (K,) of mean 1 that carry most, for signal-to-interference ratios (axes, K) of an even share."""
    count = ratios.shape[1]
    # The price of power: none is bought above the largest slope, too much below the least one with all power at once.
    low, high = float((ratios / (1.0 + count * ratios)).sum(axis=0).min()), float(ratios.sum(axis=0).max())
    for _ in range(_STEPS):
        price = np.sqrt(low * high)
        if _bought(ratios, price).mean() > 1.0:
            low = price
        else:
            high = price
    powers = _bought(ratios, high)
    return np.asarray(powers / powers.mean())


def _bought(ratios: Floats, price: float) -> Floats:
    """The powers (K,) at which the sum over axes of s / (1 + p s) has fallen to the price; 0 where it begins below."""
    low, high = np.zeros(ratios.shape[1]), np.full(ratios.shape[1], ratios.shape[0] / price)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        above = (ratios / (1.0 + middle * ratios)).sum(axis=0) > price
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.asarray(0.5 * (low + high))


def capacity_bps(ratios: Floats, powers: Floats, width_hz: float) -> float:
    """Bits a second of all axes over a band of `width_hz`, whose frequencies (K) lie evenly in it."""
    return float(np.log2(1.0 + powers * ratios).mean(axis=1).sum() * width_hz)


def spectrum_points(frequencies_hz: Floats, powers: Floats, count: int) -> Points:
    """`count` points evenly over the band, in hundredths of a hertz and tenths of a decibel beside the loudest."""
    places = np.linspace(frequencies_hz[0], frequencies_hz[-1], count)
    levels_db = 10.0 * np.log10(np.maximum(powers / powers.max(), 10.0 ** (FAINTEST_DB / 10.0)))
    values = np.interp(places, frequencies_hz, levels_db)
    return tuple(
        (round(float(hz), 2), round(float(db), 1)) for hz, db in zip(places, values - values.max(), strict=True)
    )
