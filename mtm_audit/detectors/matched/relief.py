"""A loud message beside interference that was fitted to motion which holds it.

Such a fit takes the message for noise, and its own candidates look poor. Two things set that right: what candidates
reach is compared with what waveforms drawn at random would reach in the same motion, in closed form, as evidence is
(`significance.likelihood`); and of a large alphabet the part of the band's power that gains explain is taken off the
interference again. A small alphabet's many windows need no such help, and on real motion it favours wrong starts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import WHOLE, Tones
from mtm_audit.detectors.matched.correlate import Heard, template_power
from mtm_audit.model.track import Floats

# How much of the power that gains explain is taken off a large alphabet's interference, and the largest part they may
# explain.
_RELIEF = 0.8
_LARGEST_SHARE = 0.95
# Numbers in one array of a computation.
_MOST_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Relief:
    """How the interference in the band follows from gains: `power` (observed axes, axes) of a template in a cell,
    `steady` (observed axes, 2 K) of each tone's response, `spread` (2 K,) the variance of a candidate's tones, `cells`
    in a window; `part` of the power that gains explain is taken off.
    """

    power: NDArray[np.float32]
    steady: Floats
    spread: Floats
    cells: int
    part: float

    def factors(self, gains: Floats) -> Floats:
        """How much quieter the interference is than fitted for gains (..., pairs of axes), for each pair."""
        observed, axes = self.power.shape
        squares = gains.reshape(*gains.shape[:-1], observed, axes) ** 2
        # A cell holds a unit of interference, of which the band has 2 K parts of as many as there are cells.
        share = np.sum(squares * self.power, axis=-1) * np.float32(self.cells / self.steady.shape[1])
        return np.asarray(
            np.repeat(1.0 / (1.0 - np.float32(self.part) * np.minimum(share, _LARGEST_SHARE)), axes, axis=-1)
        )

    def by_chance(self, columns: Floats, weights: Floats, gains: Floats) -> Floats:
        """Log of the mean likelihood ratio of normal waveforms drawn at random, (hypotheses, windows, starts).

        `columns` (hypotheses, windows, observed axes, 2 K) is what was heard and `weights` (hypotheses, windows,
        observed axes) of how many cells; `gains` (hypotheses, starts, pairs).
        """
        weighed = weights.astype(np.float32)[..., None] * self.steady.astype(np.float32)
        numbers = columns.size // columns.shape[2] * self.power.shape[1]
        groups = np.array_split(gains, -(-gains.shape[1] // max(1, _MOST_AT_ONCE // max(1, numbers))), axis=1)
        return np.concatenate([self._log_mean(columns, weighed, some) for some in groups], axis=-1)

    def _log_mean(self, columns: Floats, weighed: Floats, gains: Floats) -> Floats:
        """Tones of weights u, q and variance v add u^2 v / (1 + q v) - log(1 + q v), halved; `weighed` (hypotheses,
        windows, observed axes, 2 K) what q follows from.
        """
        hypotheses, starts, _ = gains.shape
        observed, axes = self.power.shape
        factors = self.factors(gains).astype(np.float32)
        # (hypotheses, starts and axes, observed axes), which every window of a hypothesis has in common.
        pulled, bent = (
            own.reshape(hypotheses, starts, observed, axes)
            .transpose(0, 1, 3, 2)
            .reshape(hypotheses, 1, starts * axes, observed)
            for own in (gains * factors, np.float32(0.5) * gains**2 * factors)
        )
        spread = self.spread.astype(np.float32)
        linear = pulled @ columns
        grown = bent @ weighed
        grown *= spread
        grown += np.float32(1.0)
        linear *= linear
        linear *= spread
        linear /= grown
        linear -= np.log(grown, out=grown)
        found = linear.reshape(hypotheses, -1, starts, axes * linear.shape[-1]).sum(axis=-1)
        return np.asarray(0.5 * found.astype(np.float64))


def relief_of(heard: Heard, tones: Tones) -> Relief:
    """That of what was heard; of the candidates' `tones` only their number and power matter."""
    part = _RELIEF if len(tones) > WHOLE else 0.0
    return Relief(template_power(tones, heard).astype(np.float32), heard.steady, heard.spread, heard.cells, part)
