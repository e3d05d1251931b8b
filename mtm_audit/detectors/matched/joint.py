"""Symbols of all windows and the gains that they share, found together by expectation-maximisation.

Window by window, a symbol is judged with gains that nothing is known of, and what each window says of them is blurred
by its doubt about the symbol. Together windows agree on gains that none of them shows alone, found for each plant from
rotations and mirrorings of the camera (Dempster, Laird and Rubin 1977; evidence of the gains by Laplace's method).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from mtm_audit.detectors.matched.coherent import starting_gains
from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE, log_sum_exp
from mtm_audit.detectors.matched.windows import Statistics
from mtm_audit.model.track import Floats

_ROUNDS = 6
# Windows times candidates times starts times plants of one computation.
_MOST_TOGETHER = 1 << 19


@dataclass(frozen=True)
class Together:
    """`beliefs` (windows, L): probabilities of each window's kept candidates, windows of a group alike; `evidence`:
    nats, the message in all these windows against none.
    """

    beliefs: Floats
    evidence: float


def decide_together(
    found: Sequence[Statistics], elsewhere: Sequence[Floats], groups: Sequence[int], count: int, prior: Floats
) -> Together:
    """What windows with one set of gains and one plant say of their symbols.

    `elsewhere` (L,) is what else speaks for each window's candidates, nats; windows of a group repeat one symbol, of
    `count` that may have been sent; `prior` (plants,) logarithms.
    """
    given = _Windows.of(found, elsewhere, groups, count)
    starts, kept = starting_gains(given.observed, given.axes), given.elsewhere.size
    first = np.repeat(starts.astype(np.float64).reshape(1, len(starts), -1), len(prior), axis=0)
    blocks = np.array_split(np.arange(len(prior)), -(-len(prior) * kept * len(starts) // _MOST_TOGETHER))
    gains, evidence = first.copy(), np.empty((len(prior), len(starts)))
    for block in blocks:
        gains[block], evidence[block] = _maximised(given.under(block), first[block])
    evidence += prior[:, None] - np.log(len(starts))
    start = int(np.argmax(log_sum_exp(evidence, axis=0)))
    weights = softmax(evidence[:, start])
    beliefs = np.zeros(given.elsewhere.shape)
    for block in blocks:
        own = given.under(block).weighed(gains[block, start : start + 1])[0]
        beliefs += np.einsum("p,pwl->wl", weights[block], own[..., 0])
    return Together(beliefs, float(log_sum_exp(evidence[:, start], axis=0)))


@dataclass(frozen=True)
class _Windows:
    """All windows under some plants, in single precision: `information` (plants, windows x L, pairs of axes) and
    `precision` (plants, windows x L, observed axes x A x A); `elsewhere` (windows, L); `places` (windows,) numbers
    their groups.
    """

    information: NDArray[np.float32]
    precision: NDArray[np.float32]
    observed: int
    axes: int
    elsewhere: Floats
    places: NDArray[np.int64]
    count: int

    @classmethod
    def of(
        cls, found: Sequence[Statistics], elsewhere: Sequence[Floats], groups: Sequence[int], count: int
    ) -> "_Windows":
        """Under all plants, plants outermost."""
        observed, kept, plants, axes = found[0].information.shape
        information = np.empty((plants, len(found), kept, observed, axes), dtype=np.float32)
        precision = np.empty((*information.shape, axes), dtype=np.float32)
        for row, window in enumerate(found):
            information[:, row] = window.information.transpose(2, 1, 0, 3)
            precision[:, row] = window.precision.transpose(2, 1, 0, 3, 4)
        return cls(
            information.reshape(plants, len(found) * kept, -1),
            precision.reshape(plants, len(found) * kept, -1),
            observed,
            axes,
            np.stack(elsewhere),
            np.unique(np.asarray(groups), return_inverse=True)[1],
            count,
        )

    def under(self, plants: NDArray[np.int64]) -> "_Windows":
        """The same under some of the plants, which follow each other."""
        block = slice(int(plants[0]), int(plants[-1]) + 1)
        return replace(self, information=self.information[block], precision=self.precision[block])

    def weighed(self, gains: Floats) -> tuple[Floats, Floats]:
        """Beliefs (plants, windows, L, starts) under gains (plants, starts, pairs); their evidence (plants, starts)."""
        turned, squares = (each.astype(np.float32).transpose(0, 2, 1) for each in (gains, self._squares(gains)))
        ratios = self.information @ turned
        ratios -= np.float32(0.5) * (self.precision @ squares)
        plants, _, starts = ratios.shape
        ratios = ratios.reshape(plants, *self.elsewhere.shape, starts) + self.elsewhere[..., None].astype(np.float32)
        totals = np.zeros((plants, int(self.places.max()) + 1, *ratios.shape[2:]), dtype=np.float32)
        for window, place in enumerate(self.places.tolist()):
            totals[:, place] += ratios[:, window]
        mixed = log_sum_exp(totals, axis=2)
        beliefs = np.exp(totals - mixed[:, :, None])[:, self.places]
        fit = (
            np.sum(mixed - np.log(self.count), axis=1, dtype=np.float64)
            - 0.5 * np.sum(gains**2, axis=2) / GAIN_VARIANCE
        )
        return beliefs, fit

    def _squares(self, gains: Floats) -> Floats:
        """Products of an observed axis's gains, (plants, starts, observed axes x A x A)."""
        each = gains.reshape(*gains.shape[:2], self.observed, self.axes)
        return (each[..., :, None] * each[..., None, :]).reshape(*gains.shape[:2], -1)

    def system(self, beliefs: Floats) -> tuple[Floats, Floats]:
        """The gains' precision (plants, starts, observed axes, A, A) and information, all windows and their prior."""
        plants, starts = len(beliefs), beliefs.shape[-1]
        flat = beliefs.reshape(plants, -1, starts).transpose(0, 2, 1)
        shape = (plants, starts, self.observed, self.axes)
        precision = (flat @ self.precision).reshape(*shape, self.axes) + np.eye(self.axes) / GAIN_VARIANCE
        return precision, (flat @ self.information).reshape(shape)


def _maximised(given: _Windows, gains: Floats) -> tuple[Floats, Floats]:
    """Gains (plants, starts, pairs) improved, and the evidence of each (plants, starts)."""
    for _ in range(_ROUNDS):
        precision, information = given.system(given.weighed(gains)[0])
        gains = np.linalg.solve(precision, information[..., None]).reshape(gains.shape)
    beliefs, fit = given.weighed(gains)
    precision, _ = given.system(beliefs)
    spent = np.linalg.slogdet(precision)[1].sum(axis=2) + gains.shape[2] * np.log(GAIN_VARIANCE)
    return gains, fit - 0.5 * spent
