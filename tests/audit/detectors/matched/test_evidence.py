import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from mtm_audit.detectors.matched.evidence import half_log_evidence, log_sum_exp

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS, st.integers(1, 3), st.floats(1e-3, 1e3))
def test_the_evidence_is_that_of_solving_each_system_by_itself(seed, axes, size):
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((4, 5, axes, axes))
    precision = size * (roots @ roots.transpose(0, 1, 3, 2) + 0.1 * np.eye(axes))
    information = rng.standard_normal((4, 5, axes)) * 10.0
    expected = (
        np.einsum("lpa,lpa->lp", information, np.linalg.solve(precision, information[..., None])[..., 0])
        - np.linalg.slogdet(precision)[1]
    ) / 2.0
    assert half_log_evidence(precision, information) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_one_precision_serves_many_candidates():
    precision, information = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([[1.0, 2.0], [0.0, -1.0], [3.0, 0.0]])
    each = [half_log_evidence(precision, row) for row in information]
    assert half_log_evidence(precision, information) == pytest.approx(np.array(each))


def test_evidence_grows_with_information():
    weak, strong = half_log_evidence(np.eye(2), np.array([[1.0, 0.0], [2.0, 0.0]]))
    assert strong - weak == pytest.approx(1.5)
    assert half_log_evidence(3.0 * np.eye(2), np.zeros(2)) == pytest.approx(-np.log(3.0))


@given(arrays(np.float64, array_shapes(min_dims=2, max_dims=2), elements=st.floats(-50.0, 50.0)))
def test_log_sum_exp_is_what_its_name_says(values):
    for axis in range(2):
        assert log_sum_exp(values, axis) == pytest.approx(np.log(np.exp(values).sum(axis=axis)))


def test_log_sum_exp_neither_overflows_nor_vanishes():
    assert log_sum_exp(np.array([1e6, 1e6]), axis=0) == pytest.approx(1e6 + np.log(2.0))
    assert log_sum_exp(np.array([-1e6, -1e6, -1e9]), axis=0) == pytest.approx(-1e6 + np.log(2.0))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_where_nothing_is_likely_the_sum_is_not_either(kind):
    values = np.array([[-np.inf, -np.inf], [-np.inf, 2.0], [1e4, 1e4]], dtype=kind)
    found = log_sum_exp(values, axis=1)
    assert found.dtype == kind
    assert found == pytest.approx([-np.inf, 2.0, 1e4 + np.log(2.0)])
