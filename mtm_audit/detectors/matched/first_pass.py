"""The first look at a window: every candidate under the prior alone, and which of them are worth a closer one.

Of a large alphabet all candidates are weighed roughly, with the tones' second moments by each tone itself, and the best
of them exactly: so many that what is left out stays behind by more than twice what the rough weighing erred.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import WHOLE
from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE, half_log_evidence, log_sum_exp
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel
from mtm_audit.detectors.matched.plants import COARSE
from mtm_audit.detectors.matched.windows import (
    Statistics,
    Window,
    pulled_by,
    response_rows,
    statistics,
    whitened_by_filter,
)
from mtm_audit.model.track import Floats

Integers = NDArray[np.int64]

# So many candidates are kept after the first look.
KEPT = 64
# Of a large alphabet so many are weighed exactly, or twice or four times as many where that leaves a doubt.
_TRIED = 256
_SAFETY = 2.0
_BLOCK = 2048


@dataclass(frozen=True)
class FirstPass:
    """`kept` (L,) the best candidates over all windows of a group; for each of them `ratios` (M,) log-likelihood ratios
    of all candidates, nats: where a large alphabet's were weighed roughly they stand below those kept.
    """

    kept: Integers
    ratios: tuple[Floats, ...]


def first_pass(windows: Sequence[Window], motions: Sequence[Motion], noise: NoiseModel, prior: Floats) -> FirstPass:
    """Look at windows that repeat one symbol; `prior` (plants,) is of `COARSE`."""
    seen = [_Looked(window, motions[window.observation], noise, prior) for window in windows]
    count = len(windows[0].tones)
    if count <= WHOLE:
        ratios = [each.exactly(np.arange(count)) for each in seen]
        return FirstPass(np.argsort(-np.sum(ratios, axis=0))[:KEPT], tuple(ratios))
    rough = [each.roughly() for each in seen]
    order = np.argsort(-np.sum(rough, axis=0), kind="stable")
    total = np.sum(rough, axis=0)[order]
    exact = [np.empty(0) for _ in seen]
    tried = 0
    while tried < count:
        more = min(max(_TRIED, 2 * tried), count)
        exact = [np.append(own, each.exactly(order[tried:more])) for own, each in zip(exact, seen, strict=True)]
        tried = more
        found = np.sum(exact, axis=0)
        # The best stand out and are estimated least well, but none of what is left out can be like them.
        error = _SAFETY * float(np.max(np.abs(found - total[:tried])[KEPT:]))
        if tried < count and total[tried] + error < np.partition(found, -KEPT)[-KEPT]:
            break
    for own, each in zip(rough, exact, strict=True):
        own[order[:tried]] = each
    return FirstPass(order[np.argsort(-found)[:KEPT]], tuple(rough))


class _Looked:
    """One window under the prior."""

    def __init__(self, window: Window, motion: Motion, noise: NoiseModel, prior: Floats) -> None:
        self._window, self._motion, self._noise, self._prior = window, motion, noise, prior
        self._rows = response_rows(window, COARSE)

    def exactly(self, symbols: Integers) -> Floats:
        """Log-likelihood ratios of some candidates, (symbols,)."""
        tones = self._window.tones.of(symbols)
        return _ratios(statistics(self._window, tones, self._rows, self._noise, self._motion.velocities), self._prior)

    def roughly(self) -> Floats:
        """The same of all, (M,), as if a tone's response had nothing to do with other tones'."""
        pulled, weights, filters, history = pulled_by(self._window, self._noise, self._motion.velocities)
        plants, width = self._rows.shape[:2]
        # The layout of tones that are kept for all stages has imaginary parts with the other sign.
        sign = np.repeat([1.0, -1.0], width // 2)
        projection = np.empty((len(pulled), plants, width), dtype=np.float32)
        power = np.empty_like(projection)
        for mine, heard in whitened_by_filter(self._rows, filters, history):
            projection[mine] = np.einsum("pkn,dn->dpk", heard, pulled[mine], optimize=True) * sign
            power[mine] = np.einsum("pkn,dn->dpk", heard**2, weights[mine], optimize=True)
        whole = self._window.tones.whole
        blocks = np.array_split(whole, -(-len(whole) // _BLOCK))
        return np.concatenate([_ratios(_rough_statistics(block, projection, power), self._prior) for block in blocks])


def _rough_statistics(
    tones: NDArray[np.float32], projection: NDArray[np.float32], power: NDArray[np.float32]
) -> Statistics:
    """Of tones (L, A, 2 K): `projection` and `power` of each unit tone, (observed axes, plants, 2 K).

    Laid out so that candidates lie next to each other in memory, which is where all sums run over plants and axes.
    """
    count, axes, width = tones.shape
    shape = (*projection.shape[:2], count)
    information = np.empty((axes, *shape), dtype=np.float32)
    precision = np.empty((axes, axes, *shape), dtype=np.float32)
    by_tone = np.ascontiguousarray(tones.transpose(1, 2, 0))
    for one in range(axes):
        information[one] = (projection.reshape(-1, width) @ by_tone[one]).reshape(shape)
        for other in range(one, axes):
            product = (power.reshape(-1, width) @ (by_tone[one] * by_tone[other])).reshape(shape)
            precision[one, other] = precision[other, one] = product
    return Statistics(information.transpose(1, 3, 2, 0), precision.transpose(2, 4, 3, 0, 1))


def _ratios(found: Statistics, log_plants: Floats) -> Floats:
    """Log-likelihood ratios (L,) with gains and plant unknown: all observed axes alike, or each apart, at even odds."""
    axes = found.information.shape[-1]
    gains = (np.eye(axes) / GAIN_VARIANCE).astype(found.precision.dtype)
    evidence = half_log_evidence(gains + found.precision, found.information)
    constant = found.information.shape[0] * 0.5 * axes * np.log(GAIN_VARIANCE)
    alike = log_sum_exp(evidence.sum(axis=0) + log_plants, axis=1)
    apart = log_sum_exp(evidence + log_plants, axis=2).sum(axis=0)
    return np.asarray(np.logaddexp(alike, apart) - np.log(2.0) - constant)
