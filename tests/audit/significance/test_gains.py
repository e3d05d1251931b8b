"""The prior over cameras and loudness: fixed beforehand, and of sum one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.significance.channel_terms import coarse_levels
from mtm_audit.significance.gains import MAGNITUDES, all_levels, orientations, precision_factors


@pytest.mark.parametrize("levels", [all_levels(), coarse_levels()])
def test_levels_have_a_prior_of_sum_one(levels):
    assert np.exp(levels.log_priors).sum() == pytest.approx(1.0)
    assert len(levels.magnitudes) == len(levels.reliefs) == len(levels.log_priors)


def test_loudness_goes_from_an_eighth_to_eight_in_three_decibels():
    assert (MAGNITUDES[0], MAGNITUDES[-1]) == (0.125, 8.0)
    assert 20.0 * np.log10(MAGNITUDES[1:] / MAGNITUDES[:-1]) == pytest.approx(3.01, abs=0.01)
    assert set(MAGNITUDES) == set(all_levels().magnitudes)


def test_two_axes_seen_on_two_are_turned_and_mirrored():
    turns = orientations(2, 2)
    assert turns @ turns.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(2), turns.shape))
    handed = np.linalg.det(turns)
    assert sorted(np.round(handed).tolist()) == [-1.0] * 16 + [1.0] * 16
    angles = np.sort(np.arctan2(turns[handed > 0, 1, 0], turns[handed > 0, 0, 0]))
    assert np.diff(angles) == pytest.approx(np.pi / 8.0)


@pytest.mark.parametrize("shape", [(2, 1), (1, 2)])
def test_one_axis_beside_two_has_directions_all_around(shape):
    turns = orientations(*shape)
    assert turns.shape == (16, *shape)
    assert np.linalg.norm(turns.reshape(16, 2), axis=1) == pytest.approx(1.0)


@pytest.mark.parametrize("shape", [(1, 1), (3, 3), (3, 2), (2, 3), (1, 3), (4, 4)])
def test_other_axes_are_seen_one_by_one_with_either_sign(shape):
    turns, shared = orientations(*shape), min(shape)
    assert turns.shape == (2**shared, *shape)
    assert np.abs(turns).sum(axis=0) == pytest.approx(2**shared * np.eye(*shape))
    assert len({turn.tobytes() for turn in turns}) == 2**shared


@given(st.integers(1, 4), st.integers(1, 4))
def test_no_orientation_comes_twice_and_each_has_its_opposite(observed, injected):
    turns = orientations(observed, injected)
    flat = np.round(turns.reshape(len(turns), -1), 9) + 0.0
    rows = {tuple(row) for row in flat.tolist()}
    assert len(rows) == len(turns)
    assert rows == {tuple(row) for row in (0.0 - flat).tolist()}
    assert turns.mean(axis=0) == pytest.approx(np.zeros((observed, injected)), abs=1e-12)


@given(st.floats(1e-6, 1e6), st.floats(1.0, 1e4), st.integers(1, 200))
def test_relief_makes_interference_quieter_and_never_silent(power, cells, tones):
    levels = all_levels()
    factors = precision_factors(levels, np.full(tones, power), cells)
    assert factors.shape == (len(levels.magnitudes), tones)
    assert np.all(factors[levels.reliefs == 0.0] == 1.0)
    assert np.all((factors >= 1.0) & (factors < 5.0))
    relieved = factors[levels.reliefs > 0.0]
    assert np.all(np.diff(relieved, axis=0) >= 0.0)
