"""A small network that attackers learn with: one layer of fixed random tanh units, and weights that are fitted."""

from collections.abc import Sequence

import numpy as np

from mtm_audit.model.track import Floats

_UNITS = 200
_RIDGE = 1e-6
# Among which a network chooses that has little to learn from.
RIDGES = tuple(10.0**power for power in range(-8, 1))
# Every so many-th of what it was told judges the ridge.
_JUDGED = 5


class Network:
    """What `inputs` (m, k) say of `targets` (m, n), fitted by least squares; to that are added `more` (m, l), linearly.

    With `gain` 1 and without `offsets` the units see the inputs at their spread; smaller gains and offsets follow
    what changes fast in a part of the inputs. Of several `ridges` it takes what does best on a fifth of the rows.
    """

    def __init__(
        self,
        inputs: Floats,
        targets: Floats,
        more: Floats | None = None,
        *,
        units: int = _UNITS,
        gain: float = 1.0,
        offsets: float = 0.0,
        ridges: Sequence[float] = (_RIDGE,),
    ) -> None:
        draw = np.random.default_rng(5)
        self._scale = inputs.std(axis=0) + 1e-9
        self._hidden = gain * draw.standard_normal((inputs.shape[1], units)) / np.sqrt(inputs.shape[1])
        self._offsets = offsets * draw.standard_normal(units)
        features = self._units(inputs, more)
        judged = np.arange(len(inputs)) % _JUDGED == 0
        best = ridges[0]
        if len(ridges) > 1:
            tried = _ridge_weights(features[~judged], targets[~judged], ridges)
            errors = [np.mean((features[judged] @ weights - targets[judged]) ** 2) for weights in tried]
            best = ridges[int(np.argmin(errors))]
        self._weights = _ridge_weights(features, targets, [best])[0]

    def __call__(self, inputs: Floats, more: Floats | None = None) -> Floats:
        """What it foretells, (m, n)."""
        return np.asarray(self._units(inputs, more) @ self._weights)

    def _units(self, inputs: Floats, more: Floats | None) -> Floats:
        scaled = inputs / self._scale
        # The inputs themselves as well, so that it is no worse than a linear predictor.
        hidden = np.tanh(scaled @ self._hidden + self._offsets)
        added = np.empty((len(scaled), 0)) if more is None else more
        return np.concatenate([hidden, scaled, np.ones((len(scaled), 1)), added], axis=1)


def _ridge_weights(features: Floats, targets: Floats, ridges: Sequence[float]) -> list[Floats]:
    """Weights (features, n) for each ridge, which is relative to the features' mean square."""
    values, vectors = np.linalg.eigh(features.T @ features)
    turned = vectors.T @ (features.T @ targets)
    weight = np.mean(features**2) * len(features)
    return [vectors @ (turned / (np.maximum(values, 0.0) + ridge * weight)[:, None]) for ridge in ridges]
