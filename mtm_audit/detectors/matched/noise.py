"""The interference: task motion, slip and tracking noise, as an autoregressive process with outliers.

One autoregressive shape for all observed axes of a recording, one innovation scale an axis, and a weight for each
sample that a Student-t law gives it, so that turns and contacts are doubted and not obeyed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Bools, Floats

_DEGREES_OF_FREEDOM = 5.0
_ROUNDS = 6
_RIDGE = 1e-2
_HIGHEST_ORDER = 8
_LOWEST_ORDER = 4
_SAMPLES_PER_COEFFICIENT = 100


@dataclass(frozen=True)
class NoiseModel:
    """`filter` (order + 1,): whitening filter, first coefficient 1. For each observation `scales` (axes,) standard
    deviations of the innovations and `weights` (axes, n) of the whitened samples, 0 where any of the order + 1
    samples behind one was not seen.
    """

    filter: Floats
    scales: tuple[Floats, ...]
    weights: tuple[Floats, ...]

    @property
    def order(self) -> int:
        """Samples of history that one whitened sample takes."""
        return len(self.filter) - 1


def model_order(samples: int) -> int:
    """Order of the autoregression that this many samples (over all axes) can carry."""
    return int(np.clip(samples // _SAMPLES_PER_COEFFICIENT, _LOWEST_ORDER, _HIGHEST_ORDER))


def whitened(signals: Floats, whitening_filter: Floats) -> Floats:
    """Apply the filter along the last axis; the first `order` samples, which lack history, are dropped."""
    order = len(whitening_filter) - 1
    count = signals.shape[-1] - order
    result: Floats = signals[..., order:].copy()
    for delay in range(1, order + 1):
        result += whitening_filter[delay] * signals[..., order - delay : order - delay + count]
    return result


def power_response(whitening_filter: Floats, cycles_per_sample: Floats) -> Floats:
    """Squared magnitude of the filter's frequency response, shape of `cycles_per_sample`."""
    delays = np.arange(len(whitening_filter))
    response: Floats = np.abs(np.exp(-2j * np.pi * np.outer(cycles_per_sample, delays)) @ whitening_filter) ** 2
    return response


def principal_axes(signals: Sequence[Floats], model: NoiseModel) -> Floats:
    """Rotation (axes, axes) to axes in which the interference of all observations together is uncorrelated.

    A camera that looks on askew mixes the task's strong turns into every observed axis; along the principal axes of
    the whitened motion they stand by themselves again, and the other axes are quiet. What was not seen counts as 0.
    """
    order = model.order
    spread = np.zeros((len(signals[0]), len(signals[0])))
    for signal, weights in zip(signals, model.weights, strict=True):
        errors = whitened(signal, model.filter) * (weights[:, order:] > 0.0)
        spread += errors @ errors.T
    rotation: Floats = np.linalg.eigh(spread)[1].T
    return rotation


def fit_noise(signals: Sequence[Floats], seen: Sequence[Bools], order: int) -> NoiseModel:
    """Iteratively reweighted least squares over all observations: `signals` (axes, n) each, `seen` (n,) each."""
    usable = [_usable(mask, order) for mask in seen]
    weights = [
        np.repeat(mask[None, :], len(signal), axis=0) * 1.0 for signal, mask in zip(signals, usable, strict=True)
    ]
    scales: list[Floats] = [np.maximum(np.std(np.diff(signal, axis=1), axis=1), 1e-12) for signal in signals]
    coefficients: Floats = np.zeros(order)
    for _ in range(_ROUNDS):
        coefficients = _solve(signals, weights, scales, order)
        whitening_filter = np.concatenate([[1.0], -coefficients])
        for index, signal in enumerate(signals):
            errors = np.zeros_like(signal)
            errors[:, order:] = whitened(signal, whitening_filter)
            variances = np.sum(weights[index] * errors**2, axis=1) / max(1.0, float(usable[index].sum()))
            variances = np.maximum(variances, 1e-24)
            doubt = (_DEGREES_OF_FREEDOM + 1.0) / (_DEGREES_OF_FREEDOM + errors**2 / variances[:, None])
            weights[index] = doubt * usable[index]
            scales[index] = np.sqrt(variances)
    return NoiseModel(np.concatenate([[1.0], -coefficients]), tuple(scales), tuple(weights))


def _usable(seen: Bools, order: int) -> Bools:
    run = np.convolve(seen, np.ones(order + 1))[: len(seen)]
    return run > order + 0.5


def _solve(signals: Sequence[Floats], weights: Sequence[Floats], scales: Sequence[Floats], order: int) -> Floats:
    normal, right = np.zeros((order, order)), np.zeros(order)
    for signal, weight, scale in zip(signals, weights, scales, strict=True):
        for axis in range(len(signal)):
            series = signal[axis] / scale[axis]
            history = np.lib.stride_tricks.sliding_window_view(series, order)[:-1, ::-1]
            weighted = history * weight[axis, order:, None]
            normal += weighted.T @ history
            right += weighted.T @ series[order:]
    normal += np.eye(order) * max(np.trace(normal), 1e-12) / order * _RIDGE
    solution: Floats = np.linalg.solve(normal, right)
    return solution
