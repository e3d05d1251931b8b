"""What the robot and the camera may do to a waveform: a family of short filters, and tones passed through them.

Every member is a pure delay and a first-order lag of unit gain at zero frequency; gains, signs and mixing of axes
are left to the estimate. Impulse responses are sampled every hundredth of a second.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.tracks import Floats

Complexes = NDArray[np.complex128]

TAP_S = 0.01
MEMORY_S = 0.8
# Beyond a window's end its waveform still moves the robot for about this long.
TAIL_S = 0.5


@dataclass(frozen=True)
class Plants:
    """A family of impulse responses: `taps` (plants, taps), each of sum 1, with the delay and lag of each."""

    delays_s: Floats
    lags_s: Floats
    taps: Floats


def plant_family(delays_s: Floats, lags_s: Floats) -> Plants:
    """All pairs of the delays and lags."""
    delays, lags = (grid.ravel() for grid in np.meshgrid(delays_s, lags_s, indexing="ij"))
    instants_s = np.arange(0.0, MEMORY_S, TAP_S) + TAP_S / 2.0
    since_s = instants_s[None, :] - delays[:, None]
    taps = np.where(since_s >= 0.0, np.exp(-np.maximum(since_s, 0.0) / lags[:, None]), 0.0)
    return Plants(delays, lags, taps / taps.sum(axis=1, keepdims=True))


# Prior ranges: delay 1 to 8 ticks of a 50 Hz loop, lag 0.05 to 0.4 s.
COARSE = plant_family(np.array([0.02, 0.06, 0.10, 0.14]), np.array([0.06, 0.13, 0.28]))
FINE = plant_family(np.arange(0.0, 0.17, 0.03), np.array([0.05, 0.1, 0.2, 0.4]))


def tone_responses(plants: Plants, tones_hz: Floats, since_start_s: Floats, length_s: float) -> Complexes:
    """Each plant's response to unit tones exp(2 pi i f t) that sound from 0 to `length_s`.

    `tones_hz` (tones,), `since_start_s` (instants,); result (plants, tones, instants).
    """
    instants_s = (np.arange(plants.taps.shape[1]) + 0.5) * TAP_S
    turned = plants.taps[:, None, :] * np.exp(-2j * np.pi * tones_hz[:, None] * instants_s)
    summed = np.concatenate([np.zeros((*turned.shape[:2], 1)), np.cumsum(turned, axis=2)], axis=2)
    heard = _at(summed, since_start_s) - _at(summed, since_start_s - length_s)
    responses: Complexes = heard * np.exp(2j * np.pi * tones_hz[:, None] * since_start_s)
    return responses


def _at(summed: Complexes, memory_s: Floats) -> Complexes:
    """The cumulative response with only the last `memory_s` seconds of input, interpolated between taps."""
    last = summed.shape[2] - 1
    place = np.clip(memory_s / TAP_S, 0.0, last)
    below = np.minimum(place.astype(np.int64), last - 1)
    part = place - below
    interpolated: Complexes = summed[:, :, below] * (1.0 - part) + summed[:, :, below + 1] * part
    return interpolated
