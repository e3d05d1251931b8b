"""A loud message beside interference that was fitted to motion which holds it.

Such a fit takes the message for noise, and its own candidates look poor. Two things set that right: the part of the
band's power that gains explain is taken off the interference again, and what candidates reach is compared with what
waveforms drawn at random would reach in the same motion, in closed form, as evidence is (`significance.likelihood`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import Tones
from mtm_audit.detectors.matched.correlate import Heard, template_power
from mtm_audit.model.track import Floats

# How much of the power that gains explain is taken off the interference, and the largest part they may explain.
_RELIEF = 0.8
_LARGEST_SHARE = 0.95


@dataclass(frozen=True)
class Relief:
    """How the interference in the band follows from gains: `power` (observed axes, axes) of a template in a cell,
    `steady` (observed axes, 2 K) of each tone's response, `spread` (2 K,) the variance of a candidate's tones, `cells`
    in a window.
    """

    power: NDArray[np.float32]
    steady: Floats
    spread: Floats
    cells: int

    def factors(self, gains: Floats) -> Floats:
        """How much quieter the interference is than fitted for gains (..., pairs of axes), for each pair."""
        observed, axes = self.power.shape
        squares = gains.reshape(*gains.shape[:-1], observed, axes) ** 2
        # A cell holds a unit of interference, of which the band has 2 K parts of as many as there are cells.
        share = np.sum(squares * self.power, axis=-1) * np.float32(self.cells / self.steady.shape[1])
        return np.asarray(np.repeat(1.0 / (1.0 - _RELIEF * np.minimum(share, _LARGEST_SHARE)), axes, axis=-1))

    def by_chance(self, columns: Floats, weights: Floats, gains: Floats) -> Floats:
        """Log of the mean likelihood ratio of normal waveforms drawn at random, (hypotheses, windows, starts).

        `columns` (hypotheses, windows, observed axes, 2 K) is what was heard and `weights` (hypotheses, windows,
        observed axes) of how many cells; `gains` (hypotheses, starts, pairs).
        """
        return np.stack([self._log_mean(columns, weights, gains[:, start]) for start in range(gains.shape[1])], axis=-1)

    def _log_mean(self, columns: Floats, weights: Floats, gains: Floats) -> Floats:
        """For gains (hypotheses, pairs): tones of weights u, q and variance v add u^2 v / (1 + q v) - log(1 + q v),
        halved.
        """
        turned = gains.reshape(-1, *self.power.shape)
        factors = self.factors(gains).reshape(turned.shape).astype(np.float32)
        linear = np.einsum("hoa,hwok->hwak", turned * factors, columns, optimize=True)
        quadratic = np.einsum("hoa,hwo,ok->hwak", 0.5 * turned**2 * factors, weights, self.steady, optimize=True)
        grown = 1.0 + quadratic * self.spread
        return np.asarray(0.5 * np.sum(linear**2 * self.spread / grown - np.log(grown), axis=(2, 3)))


def relief_of(heard: Heard, tones: Tones) -> Relief:
    """That of what was heard; of the candidates' `tones` only the power matters."""
    return Relief(template_power(tones, heard).astype(np.float32), heard.steady, heard.spread, heard.cells)
