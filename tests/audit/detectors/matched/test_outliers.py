"""Candidates under Student's t against scipy's, and what that is for: a turn that a wrong candidate hides."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import t as student

from mtm_audit.detectors.matched.noise import DEGREES_OF_FREEDOM, NoiseModel
from mtm_audit.detectors.matched.outliers import outlier_correction


@dataclass(frozen=True)
class Cells:
    """As much of a window as the law needs: which cells of which observation."""

    observation: int
    first: int
    last: int


def weighted_ratios(signals, weights, motion):
    return -0.5 * np.sum(weights[:, None] * ((motion[:, None] - signals) ** 2 - motion[:, None] ** 2), axis=(0, 2))


def test_the_law_is_students_t_of_what_a_candidate_leaves():
    rng = np.random.default_rng(3)
    cells, scales = Cells(0, 10, 40), np.array([0.5, 2.0])
    motion, signals = rng.standard_t(3, (2, 50)) * scales[:, None], rng.standard_normal((2, 6, 30))
    weights = rng.uniform(0.2, 1.2, (2, 50))
    noise = NoiseModel((np.ones((2, 1)),), (scales,), (weights,))
    seen = motion[:, 10:40] / scales[:, None]
    law = student(DEGREES_OF_FREEDOM)
    expected = np.sum(law.logpdf(seen[:, None] - signals) - law.logpdf(seen)[:, None], axis=(0, 2))
    found = outlier_correction(cells, signals, noise, motion) + weighted_ratios(signals, weights[:, 10:40], seen)
    assert found == pytest.approx(expected)


def test_what_was_not_seen_counts_nothing():
    cells, weights = Cells(0, 0, 20), np.ones((1, 20))
    motion, signals = np.ones((1, 20)), np.full((1, 1, 20), 2.0)
    weights[0, 5:] = 0.0
    noise = NoiseModel((np.ones((1, 1)),), (np.ones(1),), (weights,))
    part = outlier_correction(Cells(0, 0, 5), signals[:, :, :5], noise, motion)
    assert outlier_correction(cells, signals, noise, motion) == pytest.approx(part)


def test_a_turn_that_no_candidate_explains_decides_nothing():
    """One sample of eight sigma: the candidate that leaves six of it is not e^14 times likelier than silence."""
    motion, signals = np.zeros((1, 20)), np.zeros((1, 2, 20))
    motion[0, 7], signals[0, 1, 7] = 8.0, 2.0
    # The weights of a fit that took the turn for the symbol.
    weights = np.ones((1, 20))
    noise = NoiseModel((np.ones((1, 1)),), (np.ones(1),), (weights,))
    gaussian = weighted_ratios(signals, weights, motion)
    assert gaussian[1] - gaussian[0] == pytest.approx(14.0)
    corrected = gaussian + outlier_correction(Cells(0, 0, 20), signals, noise, motion)
    assert 0.0 < corrected[1] - corrected[0] < 2.0
