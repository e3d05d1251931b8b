"""Welch coherency of many candidates with many observations at once.

The same numbers as `sqrt(scipy.signal.coherence(x, y, window="hann", nperseg=..., noverlap=..., nfft=n))` at the
in-band bins, arranged so that each signal is transformed once and each pair costs one small product.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import get_window

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complex128]

_MAX_SEGMENT = 128
_CHUNK_VALUES = 4_000_000


def segment_length(window_ticks: int) -> int:
    """The paper's nperseg: min(128, floor(L / 2))."""
    return min(_MAX_SEGMENT, window_ticks // 2)


def segment_spectra(signals: Floats, bins: NDArray[np.int64]) -> Complexes:
    """Normalised Welch spectra of signals (..., n) at the bins k of frequency k / n: shape (..., bins, segments).

    Hann segments of the paper's length, three quarters overlap, mean removed from each. Normalised so that the sum
    over segments of |spectrum|^2 is 1 in each bin (0 where the signal has no power there), which makes the product of
    two spectra, summed over segments, their coherency.
    """
    ticks = signals.shape[-1]
    length = segment_length(ticks)
    hop = length - (3 * length) // 4
    phases = np.exp(-2j * np.pi * (np.arange(length)[:, None] * bins[None, :] % ticks) / ticks)
    weighted: Complexes = get_window("hann", length)[:, None] * phases
    # Removing a segment's mean before the transform is the same as removing it from the transform's rows.
    transform = weighted - weighted.mean(axis=0)
    segments = np.lib.stride_tricks.sliding_window_view(signals, length, axis=-1)[..., ::hop, :]
    # One real product of plain matrices costs a fraction of many small complex ones.
    parts = np.concatenate([transform.real, transform.imag], axis=1)
    products = (segments.reshape(-1, length) @ parts).reshape(*segments.shape[:-1], 2, len(bins))
    power = np.einsum("...spk,...spk->...k", products, products)
    scale = np.divide(1.0, np.sqrt(power), out=np.zeros_like(power), where=power > 0)
    products *= scale[..., None, None, :]
    spectra: Complexes = np.swapaxes(products[..., 0, :] + 1j * products[..., 1, :], -1, -2)
    return spectra


def mean_coherency(candidates: Complexes, observed: Complexes, powers: Floats | None = None) -> Floats:
    """Mean magnitude of coherency over axes and bins, every candidate with every observation.

    `candidates` (C, axes, bins, segments), `observed` (R, axes, bins, segments); result (C, R). With `powers` (bins,)
    of mean 1 each bin counts in proportion to its own.
    """
    count, axes, bins, segments = candidates.shape
    left = np.ascontiguousarray(candidates.conj().reshape(count, axes * bins, segments).transpose(1, 0, 2))
    right = np.ascontiguousarray(observed.reshape(len(observed), axes * bins, segments).transpose(1, 2, 0))
    result = np.empty((count, len(observed)))
    step = max(1, _CHUNK_VALUES // (axes * bins * max(1, len(observed))))
    for start in range(0, count, step):
        magnitudes = np.abs(left[:, start : start + step] @ right)
        if powers is not None:
            magnitudes *= np.tile(powers, axes)[:, None, None]
        result[start : start + step] = magnitudes.mean(axis=0)
    return result
