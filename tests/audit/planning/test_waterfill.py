import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mtm_audit.planning.waterfill import FAINTEST_DB, capacity_bps, spectrum_points, water_filled
from mtm_onboard.protocol.spectrum import check_points, tone_powers

RATIOS = st.tuples(st.integers(1, 3), st.integers(2, 30)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.floats(1e-4, 1e4))
)


def test_two_tones_are_filled_as_the_formula_says():
    """Levels 1 and 1/4 under the water: 2 * water = 2 + 1 + 1/4, all of it above both."""
    assert water_filled(np.array([[1.0, 4.0]])) == pytest.approx([1.625 - 1.0, 1.625 - 0.25])


def test_a_tone_above_the_water_gets_nothing():
    assert water_filled(np.array([[10.0, 10.0, 0.01]])) == pytest.approx([1.5, 1.5, 0.0], abs=1e-6)


def test_tones_that_are_alike_are_filled_alike():
    assert water_filled(np.full((2, 7), 0.3)) == pytest.approx(np.ones(7))


@given(RATIOS)
def test_powers_have_mean_one_and_none_is_below_zero(ratios):
    powers = water_filled(ratios)
    assert powers.mean() == pytest.approx(1.0)
    assert powers.min() >= 0.0


@given(RATIOS, st.integers(0, 2**32 - 1))
def test_no_other_powers_carry_more(ratios, seed):
    best = capacity_bps(ratios, water_filled(ratios), 1.0)
    rng = np.random.default_rng(seed)
    others = [np.ones(ratios.shape[1]), *rng.dirichlet(np.ones(ratios.shape[1]), 20) * ratios.shape[1]]
    assert all(capacity_bps(ratios, other, 1.0) <= best + 1e-6 * (1.0 + best) for other in others)


def test_the_capacity_is_shannon_s():
    assert capacity_bps(np.full((2, 5), 3.0), np.ones(5), 4.0) == pytest.approx(2 * 4.0 * 2.0)


@given(RATIOS)
def test_points_are_a_spectrum_that_a_scheme_takes(ratios):
    frequencies_hz = np.linspace(0.3, 8.0, ratios.shape[1])
    points = spectrum_points(frequencies_hz, water_filled(ratios), 8)
    check_points(points)
    assert (points[0][0], points[-1][0]) == (0.3, 8.0)
    assert all(FAINTEST_DB <= level_db <= 0.0 for _, level_db in points)


def test_points_follow_smooth_powers_closely():
    frequencies_hz = np.linspace(0.3, 8.0, 400)
    powers = 1.0 / (1.0 + (frequencies_hz / 3.0) ** 2)
    shares = tone_powers(spectrum_points(frequencies_hz, powers, 8), frequencies_hz)
    assert shares == pytest.approx(powers / powers.mean(), rel=0.06)
