"""The interference: task motion, slip and tracking noise, as an autoregressive process with outliers.

One autoregressive shape for all observed axes of a recording, or a longer one of its own for an axis whose motion shows
that it needs one (a gait, a rotor); one innovation scale an axis, and a weight for each sample that a Student-t law
gives it, so that turns and contacts are doubted and not obeyed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Bools, Floats

DEGREES_OF_FREEDOM = 5.0
_ROUNDS = 6
# Smaller ones read drones better whose interference is quiet beside their course (of 192 messages on real motion 4 more
# at 3e-3), and whiten a loud message away, so that evidence no longer rises with amplitude.
_RIDGE = 1e-2
_HIGHEST_ORDER = 8
_LOWEST_ORDER = 4
_SAMPLES_PER_COEFFICIENT = 100
# Orders that an axis may have for itself, and so many samples for each coefficient.
_OWN_ORDERS = (8, 16)
_OWN_SAMPLES_PER_COEFFICIENT = 12
_OWN_ROUNDS = 3
# Cells that are filtered at once where many signals are.
_TOGETHER = 64


@dataclass(frozen=True)
class NoiseModel:
    """For each observation `filters` (axes, order + 1), the whitening filters, first coefficient 1, `scales` (axes,)
    standard deviations of the innovations and `weights` (axes, n) of the whitened samples, 0 where any of the order + 1
    samples behind one was not seen.
    """

    filters: tuple[Floats, ...]
    scales: tuple[Floats, ...]
    weights: tuple[Floats, ...]

    @property
    def order(self) -> int:
        """Samples of history that one whitened sample takes, the same for all axes."""
        return int(self.filters[0].shape[1]) - 1


def model_order(samples: int) -> int:
    """Order of the autoregression that this many samples (over all axes) can carry."""
    return int(np.clip(samples // _SAMPLES_PER_COEFFICIENT, _LOWEST_ORDER, _HIGHEST_ORDER))


def whitened(signals: Floats, whitening_filter: Floats) -> Floats:
    """Apply a filter (order + 1,), or one for each row of `signals` (rows, order + 1), along the last axis.

    The first `order` samples, which lack history, are dropped.
    """
    order = whitening_filter.shape[-1] - 1
    count = signals.shape[-1] - order
    result: Floats = signals[..., order:].copy()
    for delay in range(1, order + 1):
        result += whitening_filter[..., delay, None] * signals[..., order - delay : order - delay + count]
    return result


def whitened_from_silence(signals: Floats, history: int, whitening_filter: Floats) -> Floats:
    """As `whitened` by one filter, of signals (plants, rows, n) that were silent in the `history` cells before."""
    order, count = len(whitening_filter) - 1, signals.shape[-1]
    flat = signals.reshape(-1, count)
    result = np.empty_like(flat)
    # Products of matrices whose columns hold the filter, a part of the cells after the other: many signals are filtered
    # several times as fast as tap by tap.
    for first in range(0, count, _TOGETHER):
        cells = np.arange(first, min(first + _TOGETHER, count))
        heard = np.arange(max(0, first - order), cells[-1] + 1)
        delays = cells - heard[:, None]
        taps = np.where((delays >= 0) & (delays <= order), whitening_filter[np.clip(delays, 0, order)], 0.0)
        result[:, cells[0] : cells[-1] + 1] = flat[:, heard[0] : heard[-1] + 1] @ taps.astype(flat.dtype)
    return result.reshape(signals.shape)[..., order - history :]


def power_response(whitening_filter: Floats, cycles_per_sample: Floats) -> Floats:
    """Squared magnitude of the frequency responses of filters (..., order + 1) at (tones,): (..., tones)."""
    delays = np.arange(whitening_filter.shape[-1])
    response: Floats = np.abs(whitening_filter @ np.exp(-2j * np.pi * np.outer(delays, cycles_per_sample))) ** 2
    return response


def principal_axes(signals: Sequence[Floats], model: NoiseModel) -> Floats:
    """Rotation (axes, axes) to axes in which the interference of all observations together is uncorrelated.

    A camera that looks on askew mixes the task's strong turns into every observed axis; along the principal axes of
    the whitened motion they stand by themselves again, and the other axes are quiet. What was not seen counts as 0.
    """
    order = model.order
    spread = np.zeros((len(signals[0]), len(signals[0])))
    for signal, filters, weights in zip(signals, model.filters, model.weights, strict=True):
        errors = whitened(signal, filters) * (weights[:, order:] > 0.0)
        spread += errors @ errors.T
    rotation: Floats = np.linalg.eigh(spread)[1].T
    return rotation


def fit_noise(signals: Sequence[Floats], seen: Sequence[Bools], order: int) -> NoiseModel:
    """One filter for all observations, by iteratively reweighted least squares: `signals` (axes, n) each, `seen` (n,)
    each.
    """
    usable = [_usable(mask, order) for mask in seen]
    weights = [
        np.repeat(mask[None, :], len(signal), axis=0) * 1.0 for signal, mask in zip(signals, usable, strict=True)
    ]
    scales: list[Floats] = [np.maximum(np.std(np.diff(signal, axis=1), axis=1), 1e-12) for signal in signals]
    whitening_filter: Floats = np.ones(1)
    for _ in range(_ROUNDS):
        whitening_filter = _solve(signals, weights, scales, order)
        for index, signal in enumerate(signals):
            errors = whitened(signal, whitening_filter)
            scales[index], weights[index] = _doubted(errors, weights[index], usable[index], order)
    filters = tuple(np.tile(whitening_filter, (len(signal), 1)) for signal in signals)
    return NoiseModel(filters, tuple(scales), tuple(weights))


def fit_noise_by_axis(signals: Sequence[Floats], seen: Sequence[Bools], order: int) -> NoiseModel:
    """As `fit_noise`, and a longer filter of its own for each axis that is the better for it.

    The Bayesian information criterion chooses (Schwarz 1978), on samples that every order sees.
    """
    shared = fit_noise(signals, seen, order)
    own = [
        [_own_filter(signal[axis], mask, shared.filters[row][axis], shared.scales[row][axis])
         for axis in range(len(signal))]
        for row, (signal, mask) in enumerate(zip(signals, seen, strict=True))
    ]  # fmt: skip
    longest = max((len(filter_) for filters in own for filter_ in filters), default=order + 1)
    if longest == order + 1 and all(np.array_equal(own[row], shared.filters[row]) for row in range(len(own))):
        return shared
    padded = tuple(np.stack([np.pad(each, (0, longest - len(each))) for each in filters]) for filters in own)
    scales, weights = [], []
    for row, (signal, mask) in enumerate(zip(signals, seen, strict=True)):
        usable = _usable(mask, longest - 1)
        scale, weight = shared.scales[row], shared.weights[row] * usable
        errors = whitened(signal, padded[row])
        for _ in range(_OWN_ROUNDS):
            scale, weight = _doubted(errors, weight, usable, longest - 1)
        scales.append(scale)
        weights.append(weight)
    return NoiseModel(padded, tuple(scales), tuple(weights))


def _doubted(errors: Floats, weights: Floats, usable: Bools, order: int) -> tuple[Floats, Floats]:
    """Scales (axes,) and weights (axes, n) of innovations (axes, n - order) by a Student-t law."""
    padded = np.zeros_like(weights)
    padded[:, order:] = errors
    variances = np.sum(weights * padded**2, axis=1) / max(1.0, float(usable.sum()))
    variances = np.maximum(variances, 1e-24)
    doubt = (DEGREES_OF_FREEDOM + 1.0) / (DEGREES_OF_FREEDOM + padded**2 / variances[:, None])
    return np.sqrt(variances), doubt * usable


def _own_filter(signal: Floats, seen: Bools, shared: Floats, scale: float) -> Floats:
    """The filter of one axis (n,): the shared one, or that of the order which describes the axis best."""
    longest = max(_OWN_ORDERS)
    usable = _usable(seen, longest)
    count = int(usable.sum())
    best, least = shared, _surprise(signal, shared, usable, scale, longest)
    for order in _OWN_ORDERS:
        if count < _OWN_SAMPLES_PER_COEFFICIENT * order:
            break
        found = _own_fit(signal, usable, order, scale)
        surprise = _surprise(signal, found, usable, scale, longest) + 0.5 * order * np.log(count)
        if surprise < least:
            best, least = found, surprise
    return best


def _own_fit(signal: Floats, usable: Bools, order: int, scale: float) -> Floats:
    weights, scales = usable[None] * 1.0, np.array([scale])
    found: Floats = np.ones(1)
    for _ in range(_OWN_ROUNDS):
        found = _solve([signal[None]], [weights], [scales], order)
        scales, weights = _doubted(whitened(signal[None], found), weights, usable, order)
    return found


def _surprise(signal: Floats, whitening_filter: Floats, usable: Bools, scale: float, longest: int) -> float:
    """Negative log-likelihood of the innovations under a Student-t law whose scale suits them best."""
    order = len(whitening_filter) - 1
    errors = whitened(signal[None], whitening_filter)[:, longest - order :]
    weights = usable[None, longest:] * 1.0
    scales = np.array([scale])
    for _ in range(_OWN_ROUNDS):
        scales, weights = _doubted(errors, weights, usable[longest:], 0)
    squares = errors[0] ** 2 / scales[0] ** 2
    density = np.log(scales[0]) + 0.5 * (DEGREES_OF_FREEDOM + 1.0) * np.log1p(squares / DEGREES_OF_FREEDOM)
    return float(density[usable[longest:]].sum())


def _usable(seen: Bools, order: int) -> Bools:
    run = np.convolve(seen, np.ones(order + 1))[: len(seen)]
    return run > order + 0.5


def _solve(signals: Sequence[Floats], weights: Sequence[Floats], scales: Sequence[Floats], order: int) -> Floats:
    """The whitening filter (order + 1,) of least squares."""
    normal, right = np.zeros((order, order)), np.zeros(order)
    for signal, weight, scale in zip(signals, weights, scales, strict=True):
        for axis in range(len(signal)):
            series = signal[axis] / scale[axis]
            history = np.lib.stride_tricks.sliding_window_view(series, order)[:-1, ::-1]
            weighted = history * weight[axis, order:, None]
            normal += weighted.T @ history
            right += weighted.T @ series[order:]
    normal += np.eye(order) * max(np.trace(normal), 1e-12) / order * _RIDGE
    return np.concatenate([[1.0], -np.linalg.solve(normal, right)])
