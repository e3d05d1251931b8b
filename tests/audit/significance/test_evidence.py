import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.significance.decoys import DecoyComparison
from mtm_audit.significance.evidence import Evidence, needed_nats

DECOYS = DecoyComparison(3.0, np.arange(8.0), 0.125)


@given(st.floats(-2000.0, 2000.0))
def test_the_p_value_is_markov_s_bound(nats):
    p_value = Evidence(nats).p_value
    assert 0.0 < p_value <= 1.0
    assert p_value == 1.0 if nats <= 0.0 else p_value == pytest.approx(math.exp(-min(nats, 690.0)), rel=1e3 - 1.0)
    assert Evidence(nats).bits == pytest.approx(nats / math.log(2.0))


@pytest.mark.parametrize(("nats", "p_value"), [(0.0, 1.0), (-5.0, 1.0), (math.log(1e4), 1e-4), (1e9, 1e-300)])
def test_p_values_are_never_zero_nor_above_one(nats, p_value):
    assert Evidence(nats).p_value == pytest.approx(p_value)


@given(st.floats(-100.0, 100.0), st.floats(0.0, 100.0))
def test_more_evidence_never_makes_the_p_value_larger(nats, more):
    assert Evidence(nats + more).p_value <= Evidence(nats).p_value


def test_exact_evidence_comes_before_decoys():
    assert Evidence(math.log(1000.0), DECOYS).p_value == pytest.approx(1e-3)
    assert Evidence(-4.0, DECOYS).bits < 0.0


def test_without_exact_evidence_decoys_speak():
    assert Evidence(None, DECOYS).p_value == 0.125
    assert Evidence(None, DECOYS).bits == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("threshold", "alphabet", "positions", "odds"),
    [(1e-4, 4, 2, 6e4), (1e-4, 256, 8, 255 * 8e4), (0.1, 2, 1, 10.0), (1e-2, 1, 1, 100.0)],
)
def test_all_wrong_candidates_of_all_positions_are_paid_for(threshold, alphabet, positions, odds):
    assert needed_nats(threshold, alphabet, positions) == pytest.approx(math.log(odds))
