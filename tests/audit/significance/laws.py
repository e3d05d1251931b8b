"""What every e-value holds over the law of the waveforms, whatever the motion.

`found` are log e-values (hypotheses, groups, waveforms), `variance` the exact variance (hypotheses, groups) of each.
"""

import numpy as np
import pytest
from scipy import stats


def assert_mean_is_one(found, variance):
    calm = variance < 4.0
    assert calm.sum() >= 20
    means = np.exp(found[calm]).mean(axis=-1)
    errors = np.sqrt(variance[calm] / found.shape[-1])
    # All of some dozens of means at once, by Bonferroni with a thousandth.
    assert np.all(np.abs(means - 1.0) <= stats.norm.isf(0.0005 / calm.sum()) * errors)


def assert_spread_is_the_law_s(found, variance):
    calm = (variance > 0.01) & (variance < 0.5)
    assert calm.sum() >= 5
    assert np.exp(found[calm]).var(axis=-1) == pytest.approx(variance[calm], rel=0.35)


def most_passing(found, share):
    """How many waveforms of each hypothesis and group may pass 1 / share, all of them at once with a thousandth."""
    count = found[..., 0].size
    return stats.binom.isf(0.001 / count, found.shape[-1], share)
