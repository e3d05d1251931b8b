"""What the robot and the camera may do to a waveform: a family of short filters, and tones passed through them.

A member is a pure delay and a first-order lag; some give back after a while what they have followed, as a robot does
whose controller holds a place against the noise; some are second-order, as a speed loop or a body that tilts; some lack
a part of the band, as a speed loop does whose filter keeps a resonance quiet. Gains, signs and mixing of axes are left
to the estimate. Impulse responses are sampled every hundredth of a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from mtm_audit.model.track import Floats

Complexes = NDArray[np.complex128]

TAP_S = 0.01
MEMORY_S = 0.8
# Beyond a window's end its waveform still moves the robot for about this long.
TAIL_S = 0.5


@dataclass(frozen=True)
class Plants:
    """A family of impulse responses: `taps` (plants, taps), with the delay and lag of each.

    `returns_s` is the time constant with which a plant gives back what it follows, infinite where it does not and the
    taps' sum is 1; `notches_hz` where the notch filter before it lets nothing pass, infinite where there is none.
    """

    delays_s: Floats
    lags_s: Floats
    returns_s: Floats
    notches_hz: Floats
    taps: Floats


def plant_family(delays_s: Floats, lags_s: Floats) -> Plants:
    """All pairs of the delays and lags, of unit gain at zero frequency."""
    delays, lags = (grid.ravel() for grid in np.meshgrid(delays_s, lags_s, indexing="ij"))
    instants_s = np.arange(0.0, MEMORY_S, TAP_S) + TAP_S / 2.0
    since_s = instants_s[None, :] - delays[:, None]
    taps = np.where(since_s >= 0.0, np.exp(-np.maximum(since_s, 0.0) / lags[:, None]), 0.0)
    none = np.full(len(delays), np.inf)
    return Plants(delays, lags, none, none, taps / taps.sum(axis=1, keepdims=True))


def returning(family: Plants, returns_s: Sequence[float]) -> Plants:
    """The family's plants followed by a first-order high pass, once for each of its time constants `returns_s`."""
    since_s = np.arange(family.taps.shape[1]) * TAP_S + TAP_S / 2.0
    taps = []
    for return_s in returns_s:
        given_back = np.exp(-since_s / return_s) * TAP_S / return_s
        taps += [own - np.convolve(own, given_back)[: len(own)] for own in family.taps]
    times, count = len(returns_s), len(family.taps)
    return Plants(np.tile(family.delays_s, times), np.tile(family.lags_s, times), np.repeat(returns_s, count),
                  np.tile(family.notches_hz, times), np.array(taps))  # fmt: skip


def notched(family: Plants, notches_hz: Sequence[float], quality: float) -> Plants:
    """The family's plants behind a second-order notch filter, once for each of its frequencies."""
    filters = [signal.iirnotch(notch_hz, quality, fs=1.0 / TAP_S) for notch_hz in notches_hz]
    taps = [signal.lfilter(*each, family.taps, axis=1) for each in filters]
    times, count = len(notches_hz), len(family.taps)
    return Plants(np.tile(family.delays_s, times), np.tile(family.lags_s, times), np.tile(family.returns_s, times),
                  np.repeat(notches_hz, count), np.concatenate(taps))  # fmt: skip


def without_notches(family: Plants) -> Plants:
    """The same plants, those with a notch by their delay and lag alone."""
    taps = family.taps.copy()
    for plant in np.flatnonzero(np.isfinite(family.notches_hz)):
        taps[plant] = plant_family(family.delays_s[plant, None], family.lags_s[plant, None]).taps[0]
    return replace(family, notches_hz=np.full(len(taps), np.inf), taps=taps)


def second_order(naturals_hz: Sequence[float], damping: float) -> Plants:
    """Undelayed plants of two poles with these natural frequencies, of unit gain at zero frequency; damping below 1.

    The lag given for each is that of its phase at low frequencies.
    """
    instants_s = np.arange(0.0, MEMORY_S, TAP_S) + TAP_S / 2.0
    rates = 2.0 * np.pi * np.array(naturals_hz)
    swings = np.exp(-damping * rates[:, None] * instants_s) * np.sin(
        rates[:, None] * np.sqrt(1.0 - damping**2) * instants_s
    )
    none = np.full(len(rates), np.inf)
    return Plants(np.zeros(len(rates)), 2.0 * damping / rates, none, none,
                  swings / swings.sum(axis=1, keepdims=True))  # fmt: skip


def joined(*families: Plants) -> Plants:
    """The plants of all families."""
    return Plants(*(np.concatenate([getattr(one, field.name) for one in families]) for field in fields(Plants)))


# Prior ranges: delay 1 to 8 ticks of a 50 Hz loop, lag 0.05 to 0.4 s; and the noise undone with a tenth of a second or
# a third, for which a few delays and lags will do.
_RETURNING = returning(plant_family(np.array([0.02, 0.10]), np.array([0.06, 0.28])), (0.1, 0.3))
COARSE = joined(plant_family(np.array([0.02, 0.06, 0.10, 0.14]), np.array([0.06, 0.13, 0.28])), _RETURNING)
# Notches are so broad that four of them leave no part of the band to none.
_NOTCHED = notched(plant_family(np.array([0.03, 0.09]), np.array([0.1, 0.2])), (1.0, 1.5, 2.2, 3.2), 0.8)
FINE = joined(plant_family(np.arange(0.0, 0.17, 0.03), np.array([0.05, 0.1, 0.2, 0.4])), _RETURNING, _NOTCHED)


def tone_responses(plants: Plants, tones_hz: Floats, since_start_s: Floats, length_s: float) -> Complexes:
    """Each plant's response to unit tones exp(2 pi i f t) that sound from 0 to `length_s`.

    `tones_hz` (tones,), `since_start_s` (instants,); result (plants, tones, instants).
    """
    instants_s = (np.arange(plants.taps.shape[1]) + 0.5) * TAP_S
    turned = plants.taps[:, None, :] * np.exp(-2j * np.pi * tones_hz[:, None] * instants_s)
    summed = np.concatenate([np.zeros((*turned.shape[:2], 1)), np.cumsum(turned, axis=2)], axis=2)
    # Between the transients at its begin and end a response is settled.
    moving = (since_start_s < MEMORY_S) | (since_start_s > length_s)
    heard = np.repeat(summed[:, :, -1:], len(since_start_s), axis=2)
    moving_s = since_start_s[moving]
    heard[:, :, moving] = _at(summed, moving_s) - _at(summed, moving_s - length_s)
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
