"""Candidates weighed by a law with outliers, as the noise is fitted by one.

Each sample's weight follows from what the motion holds besides the symbol that is believed, so a wrong belief that
hides a sharp turn keeps its own samples' weights. Under Student's t itself each candidate answers for what it leaves.
"""

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.noise import DEGREES_OF_FREEDOM, NoiseModel, whitened, whitened_from_silence
from mtm_audit.detectors.matched.windows import Window
from mtm_audit.model.track import Floats


def outlier_correction(window: Window, signals: Floats, noise: NoiseModel, residual: Floats) -> NDArray[np.float64]:
    """What log-likelihood ratios (L,) of candidates gain by Student's t beside the Gaussian law of fixed weights.

    `signals` (observed axes, L, n) are what each candidate adds to the motion, in units of the noise; `residual`
    (observed axes, cells) is the motion less what all other windows are believed to add.
    """
    order, filters = noise.order, noise.filters[window.observation]
    before = max(0, window.first - order)
    observed = whitened(residual[:, before : window.last], filters) / noise.scales[window.observation][:, None]
    weights = noise.weights[window.observation][:, before + order : window.last]
    gained = np.zeros(signals.shape[1])
    for axis, (seen, weight) in enumerate(zip(observed, weights, strict=True)):
        left = seen - whitened_from_silence(signals[axis][None], window.first - before, filters[axis])[0]
        by_law = (DEGREES_OF_FREEDOM + 1.0) * (_log_spread(left) - _log_spread(seen)) * (weight > 0.0)
        by_weight = weight * (left**2 - seen**2)
        gained += 0.5 * (by_weight - by_law).sum(axis=1)
    return gained


def _log_spread(errors: Floats) -> Floats:
    return np.asarray(np.log1p(errors**2 / DEGREES_OF_FREEDOM))
