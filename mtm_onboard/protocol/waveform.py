"""The keyed waveform, version 1: a sum of in-band tones whose amplitudes and phases come from the key.

    x[t] = scale * sum over k in K of A_k cos(2 pi k t / n - phi_k),    t = 0 .. n-1

It is a formula in t, so both sides may evaluate it at any instant. With `power = "ensemble"` every sample is
exactly N(0, 1) over keys; with `power = "window"` every window has mean square exactly 1.

A spectrum multiplies each tone by sqrt(w_k), see `spectrum`. Samples of "ensemble" stay exactly N(0, 1); windows of
"window" then have mean square 1 on the average over keys, and less spread than those of "ensemble".
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.keystream import streams
from mtm_onboard.protocol.scheme import Channel, Power, Scheme, count_bins
from mtm_onboard.protocol.spectrum import tone_powers

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_BYTES_PER_TONE = 16


@lru_cache(maxsize=256)
def tone_bins(window_ticks: int, rate_hz: float, band_hz: tuple[float, float]) -> NDArray[np.int64]:
    """In-band bins k, ascending: 0 < k < n/2 and band_lo <= k * rate_hz / n <= band_hi. Read-only, shape (K,)."""
    low, high = band_hz
    bins = np.arange(1, (window_ticks + 1) // 2)
    frequencies_hz = bins * rate_hz / window_ticks
    chosen = bins[(frequencies_hz >= low) & (frequencies_hz <= high)]
    assert len(chosen) == count_bins(window_ticks, rate_hz, band_hz)
    chosen.flags.writeable = False
    return chosen


def channel_tones(scheme: Scheme, channel: Channel) -> tuple[Floats, Floats]:
    """Each tone's frequency in hertz, and its mean power beside that of an even share, of mean 1: (K,) each."""
    return band_tones(scheme, scheme.window_ticks(channel))


def band_tones(scheme: Scheme, ticks: int) -> tuple[Floats, Floats]:
    """As `channel_tones`, of a stretch of so many ticks."""
    tones_hz = tone_bins(ticks, scheme.rate_hz, scheme.band_hz) * scheme.rate_hz / ticks
    if scheme.spectrum is None:
        return tones_hz, np.ones(len(tones_hz))
    return tones_hz, tone_powers(scheme.spectrum, tones_hz)


def draw_tones(secret: bytes, epoch: int, window: int, symbol: int, axis: int, tones: int) -> tuple[Floats, Floats]:
    """Amplitudes A_k (Rayleigh) and phases phi_k (uniform, radians) of one waveform, each of shape (tones,)."""
    amplitudes, phases_rad = draw_alphabet(secret, epoch, window, [symbol], [axis], tones)
    return amplitudes[0, 0], phases_rad[0, 0]


def draw_alphabet(
    secret: bytes, epoch: int, window: int, symbols: Sequence[int], axes: Sequence[int], tones: int
) -> tuple[Floats, Floats]:
    """Amplitudes and phases as of `draw_tones` for each symbol and axis: (symbols, axes, tones) each."""
    places = ((epoch, window, symbol, axis) for symbol in symbols for axis in axes)
    data = streams(secret, "symbol", places, _BYTES_PER_TONE * tones)
    words = np.frombuffer(data, dtype="<u8").reshape(len(symbols), len(axes), tones, 2) >> np.uint64(11)
    uniform = (words[..., 0].astype(np.float64) + 0.5) / 2.0**53
    turns = words[..., 1].astype(np.float64) / 2.0**53
    return np.sqrt(-2.0 * np.log(uniform)), 2.0 * np.pi * turns


def phasors(amplitudes: Floats, phases_rad: Floats, power: Power) -> Complexes:
    """Scaled complex tones c_k, same shape as the input (..., K), so that x[t] = Re sum_k c_k exp(2 pi i k t / n)."""
    if power == "ensemble":
        scale: Floats | float = math.sqrt(1.0 / amplitudes.shape[-1])
    else:
        scale = np.sqrt(2.0 / np.sum(amplitudes**2, axis=-1, keepdims=True))
    tones: Complexes = scale * amplitudes * np.exp(-1j * phases_rad)
    return tones


def tone_basis(bins: NDArray[np.int64], window_ticks: int, ticks: NDArray[Any]) -> Complexes:
    """exp(2 pi i k t / n) for each (possibly fractional) tick and bin; shape (ticks, K)."""
    whole: NDArray[Any] = np.asarray(ticks)
    if np.issubdtype(whole.dtype, np.integer):
        # Reduced modulo n in integers first, so that the phase stays exact however long the window is.
        turns = (whole[:, None] * bins[None, :]) % window_ticks / window_ticks
    else:
        turns = whole[:, None] * bins[None, :] / window_ticks
    basis: Complexes = np.exp(2j * np.pi * turns)
    return basis


def evaluate(tones: Complexes, bins: NDArray[np.int64], window_ticks: int, ticks: NDArray[Any]) -> Floats:
    """Samples of waveforms with tones (..., K) at `ticks` (t,): shape (..., t)."""
    basis = tone_basis(bins, window_ticks, ticks)
    samples: Floats = tones.real @ basis.real.T - tones.imag @ basis.imag.T
    return samples


def evaluate_window(tones: Complexes, bins: NDArray[np.int64], window_ticks: int) -> Floats:
    """`evaluate` at the window's whole ticks, (..., window_ticks), by a Fourier transform: quick for long windows."""
    spectrum = np.zeros((*tones.shape[:-1], window_ticks // 2 + 1), dtype=np.complex128)
    spectrum[..., bins] = tones * (window_ticks / 2)
    samples: Floats = np.fft.irfft(spectrum, window_ticks)
    return samples
