"""Linear least-squares prediction, for attackers who subtract what they foretell of the noise."""

import numpy as np

from mtm_audit.model.track import Floats

_RIDGE = 1e-6


def lagged(series: Floats, lags: range) -> Floats:
    """(rollouts, ticks, len(lags)): a series (rollouts, ticks) as it was so many ticks before, zero before it began."""
    rollouts, ticks = series.shape
    result = np.zeros((rollouts, ticks, len(lags)))
    for column, lag in enumerate(lags):
        result[:, lag:, column] = series[:, : ticks - lag] if lag else series
    return result


def fitted(features: Floats, target: Floats) -> Floats:
    """Weights (n,) that foretell `target` (m,) from `features` (m, n) best, with a little ridge."""
    scale = float(np.mean(features**2)) or 1.0
    gram = features.T @ features + _RIDGE * scale * len(features) * np.eye(features.shape[1])
    return np.asarray(np.linalg.solve(gram, features.T @ target))


def share_foretold(truth: Floats, foretold: Floats) -> float:
    """R2: how much of the variance goes when what was foretold is subtracted; below zero when that adds to it."""
    return float(1.0 - np.mean((truth - foretold) ** 2) / np.mean(truth**2))
