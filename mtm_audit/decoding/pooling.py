"""Channels that carry the same symbols, taken together: the paper's pooling of the arrangement "same"."""

import numpy as np
from scipy.special import softmax

from mtm_audit.model.track import Floats
from mtm_onboard.protocol.scheme import Pooling

_LEAST = 1e-300


def pooled_posteriors(posteriors: Floats) -> Floats:
    """Posteriors (positions, M) of independent channels together, from those of each (channels, positions, M)."""
    pooled: Floats = softmax(np.log(np.maximum(posteriors, _LEAST)).sum(axis=0), axis=1)
    return pooled


def pooled_symbols(scores: Floats, pooling: Pooling) -> list[int]:
    """Decisions (positions,) from scores (channels, positions, M): the largest mean, or the majority vote.

    The mean breaks a tie of votes.
    """
    means = scores.mean(axis=0)
    if pooling == "mean":
        return [int(symbol) for symbol in np.argmax(means, axis=1)]
    votes = np.zeros_like(means)
    for own in scores:
        np.add.at(votes, (np.arange(len(votes)), np.argmax(own, axis=1)), 1.0)
    span = np.ptp(means, axis=1, keepdims=True)
    ranked = votes + 0.5 * (means - means.min(axis=1, keepdims=True)) / np.maximum(span, _LEAST)
    return [int(symbol) for symbol in np.argmax(ranked, axis=1)]
