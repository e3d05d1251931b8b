import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.planning.capacity import capacity_bits, capacity_shares


@given(st.integers(2, 65_536))
def test_capacity_is_all_when_all_is_right_and_none_at_chance(alphabet):
    assert float(capacity_bits(1.0, alphabet)) == pytest.approx(math.log2(alphabet), abs=1e-12)
    assert float(capacity_bits(1.0 / alphabet, alphabet)) == pytest.approx(0.0, abs=1e-12)


@given(st.integers(2, 256), st.floats(0.0, 1.0))
def test_capacity_is_the_information_of_a_symmetric_channel(alphabet, accuracy):
    wrong = (1.0 - accuracy) / (alphabet - 1)
    rows = [accuracy, *[wrong] * (alphabet - 1)]
    information = math.log2(alphabet) + math.fsum(p * math.log2(p) for p in rows if p > 0.0)
    assert float(capacity_bits(accuracy, alphabet)) == pytest.approx(information, abs=1e-12)


@given(st.integers(2, 256), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_above_chance_capacity_rises_with_accuracy(alphabet, one, other):
    low, high = sorted(1.0 / alphabet + (1.0 - 1.0 / alphabet) * part for part in (one, other))
    assert float(capacity_bits(low, alphabet)) <= float(capacity_bits(high, alphabet)) + 1e-12


def test_stronger_channels_carry_more_and_chance_nothing():
    shares = capacity_shares(np.array([0.9, 0.7, 0.25, 0.1]), 4)
    assert shares.sum() == pytest.approx(1.0)
    assert shares[0] > shares[1] > 0.0
    assert shares[2:] == pytest.approx([0.0, 0.0])


def test_channels_that_all_carry_nothing_share_equally():
    assert capacity_shares(np.array([0.25, 0.1]), 4) == pytest.approx([0.5, 0.5])
