"""The normaliser against mpmath: it is what the verdict's validity rests on."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mtm_audit.significance.normaliser import SPHERE_SQUARED_RADIUS, log_mean_normal, log_mean_sphere

DIMENSIONS = (4, 6, 10, 40, 200, 480, 482, 1000, 4000)
# How near the contour integral comes in nats: its integrand falls slowly only where tones are few.
CLOSE = {2: 1e-6, 4: 1e-6}
CONCENTRATIONS = (1e-8, 1e-3, 0.1, 1.0, 10.0, 100.0, 500.0, 2000.0)


@pytest.fixture(autouse=True)
def _forty_digits():
    with mp.workdps(40):
        yield


def of_concentration(dimension, concentration, seed=1):
    """A random direction with |u| |t| = `concentration` on the sphere of squared radius 2."""
    direction = np.random.default_rng(seed).normal(size=dimension)
    return direction * concentration / np.sqrt(2.0) / np.linalg.norm(direction)


def squared_norm(values):
    return sum(mp.mpf(float(value)) ** 2 for value in values)


def log_mean_cap(dimension, squared):
    """Log mean of exp(u . t) on the sphere of squared radius 2 in closed form (von Mises-Fisher), of |u|^2."""
    return mp.log(mp.hyp0f1(mp.mpf(dimension) / 2, squared / 2))


def test_the_sphere_is_the_one_that_windows_of_unit_power_lie_on():
    assert SPHERE_SQUARED_RADIUS == 2.0


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_without_a_quadratic_part_it_is_von_mises_fisher_s(dimension):
    linear = np.array([of_concentration(dimension, concentration) for concentration in CONCENTRATIONS])
    found = log_mean_sphere(linear, np.zeros_like(linear))
    expected = [float(log_mean_cap(dimension, squared_norm(row))) for row in linear]
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-10)


@pytest.mark.parametrize("concentration", [0.1, 10.0, 2000.0])
@pytest.mark.parametrize("spread", [1e-6, 1.0, 300.0])
def test_a_quadratic_part_alike_in_all_directions_is_a_factor(concentration, spread):
    linear = of_concentration(60, concentration)
    found = log_mean_sphere(linear, np.full(60, spread))
    assert found == pytest.approx(float(log_mean_cap(60, squared_norm(linear))) - spread, rel=1e-12, abs=1e-10)


@pytest.mark.parametrize(("first", "second"), [(0.0, 3.0), (0.5, 40.0), (250.0, 1.0)])
@pytest.mark.parametrize("dimension", [4, 40, 482, 4000])
def test_two_spreads_without_a_linear_part_are_kummer_s_function(dimension, first, second):
    half = dimension // 2
    spread = np.concatenate([np.full(half, first), np.full(half, second)])
    expected = mp.log(mp.hyp1f1(mp.mpf(dimension) / 4, mp.mpf(dimension) / 2, second - first)) - second
    assert log_mean_sphere(np.zeros(dimension), spread) == pytest.approx(
        float(expected), rel=1e-11, abs=CLOSE.get(dimension, 1e-9)
    )


@pytest.mark.parametrize(("dimension", "scale"), [(4, 3.0), (12, 8.0), (100, 20.0)])
@pytest.mark.parametrize(("first", "second"), [(0.0, 2.0), (30.0, 0.5), (0.0, 120.0)])
def test_fisher_bingham_of_two_spreads_is_mpmath_s_quadrature(dimension, scale, first, second):
    """The share x of |t|^2 in the first half has a beta law; within a half directions are uniform."""
    half = dimension // 2
    linear = of_concentration(dimension, scale, seed=dimension)
    found = log_mean_sphere(linear, np.concatenate([np.full(half, first), np.full(half, second)]))
    one, other = squared_norm(linear[:half]), squared_norm(linear[half:])
    order = mp.mpf(half) / 2

    def density(x):
        halves = mp.hyp0f1(order, one * x / 2) * mp.hyp0f1(order, other * (1 - x) / 2)
        return x ** (order - 1) * (1 - x) ** (order - 1) * halves * mp.exp(-first * x - second * (1 - x))

    with mp.workdps(30):
        expected = mp.log(mp.quad(density, mp.linspace(0, 1, 33)) / mp.beta(order, order))
    assert found == pytest.approx(float(expected), rel=1e-10, abs=CLOSE.get(dimension, 1e-9))


@pytest.mark.parametrize("linear", [(0.0, 0.0), (0.2, -0.1), (2.0, 5.0), (40.0, 0.0)])
@pytest.mark.parametrize("spread", [(0.0, 0.0), (0.3, 1.0), (4.0, 0.0), (9.0, 4.0)])
def test_fisher_bingham_on_the_circle_is_plain_quadrature(spread, linear):
    """A single tone; the trapezoidal rule is exact to rounding for a periodic integrand."""
    angles = 2.0 * np.pi * np.arange(4000) / 4000.0
    x, y = np.sqrt(2.0) * np.cos(angles), np.sqrt(2.0) * np.sin(angles)
    exponent = linear[0] * x + linear[1] * y - 0.5 * (spread[0] * x**2 + spread[1] * y**2)
    expected = np.log(np.mean(np.exp(exponent)))
    assert log_mean_sphere(np.array(linear), np.array(spread)) == pytest.approx(expected, abs=CLOSE[2])


@pytest.mark.parametrize("spread", [(0.0, 0.0, 0.0, 0.0), (0.5, 0.5, 7.0, 7.0), (0.1, 2.0, 5.0, 11.0)])
@pytest.mark.parametrize("linear", [(0.0, 0.0, 0.0, 0.0), (0.3, -0.2, 0.1, 0.4), (4.0, 1.0, -6.0, 2.0)])
def test_fisher_bingham_of_four_spreads_is_plain_quadrature(spread, linear):
    """Two circles whose squared radii share 2: the share is uniform, angles are uniform and by the trapezoidal rule."""
    angles = 2.0 * np.pi * np.arange(200) / 200.0
    nodes, shares = np.polynomial.legendre.leggauss(120)
    radii = np.sqrt(1.0 + nodes)

    def circle(place, radius):
        x, y = radius[:, None] * np.cos(angles), radius[:, None] * np.sin(angles)
        exponent = linear[place] * x + linear[place + 1] * y
        return np.exp(exponent - 0.5 * (spread[place] * x**2 + spread[place + 1] * y**2)).mean(axis=1)

    expected = np.log(0.5 * np.sum(shares * circle(0, radii) * circle(2, radii[::-1])))
    found = log_mean_sphere(np.array(linear), np.array(spread))
    assert found == pytest.approx(expected, abs=CLOSE[4])


def test_the_normal_law_is_its_closed_form_element_by_element():
    rng = np.random.default_rng(2)
    for dimension in (4, 60, 482):
        linear, quadratic = rng.normal(size=dimension) * 3.0, rng.uniform(0.0, 40.0, dimension)
        variance = mp.mpf(2) / dimension
        expected = mp.mpf(0)
        for one, spread in zip(linear.tolist(), quadratic.tolist(), strict=True):
            narrowed = variance / (1 + mp.mpf(spread) * variance)
            expected += (mp.log(narrowed / variance) + mp.mpf(one) ** 2 * narrowed) / 2
        assert log_mean_normal(linear, quadratic) == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize(("linear", "quadratic"), [(0.0, 0.0), (1.5, 0.0), (-2.0, 3.0), (0.0, 9.0)])
def test_the_normal_law_is_mpmath_s_quadrature(linear, quadratic):
    """Over d = 4 elements, each of variance one half."""

    def density(t):
        return mp.exp(linear * t - quadratic * t**2 / 2 - t**2) / mp.sqrt(mp.pi)

    with mp.workdps(15):
        expected = 4 * mp.log(mp.quad(density, [-mp.inf, 0, mp.inf]))
    assert log_mean_normal(np.full(4, linear), np.full(4, quadratic)) == pytest.approx(float(expected), abs=1e-9)


@pytest.mark.parametrize("log_mean", [log_mean_normal, log_mean_sphere])
def test_nothing_at_all_has_mean_one(log_mean):
    assert log_mean(np.zeros((3, 5, 60)), np.zeros((3, 5, 60))) == pytest.approx(np.zeros((3, 5)), abs=1e-12)


VECTORS = st.integers(2, 40).flatmap(
    lambda half: st.tuples(
        arrays(np.float64, 2 * half, elements=st.floats(-1e4, 1e4)),
        arrays(np.float64, 2 * half, elements=st.floats(0.0, 1e4)),
    )
)


@given(VECTORS)
@example((np.array([0.0, 146.0, 0.0, 0.0]), np.array([0.0, 113.0, 113.0, 113.0])))
def test_the_mean_lies_between_jensen_s_bound_and_the_largest(weights):
    linear, quadratic = weights
    found = float(log_mean_sphere(linear, quadratic))
    slack = 1e-9 * (1.0 + np.abs(linear).max() + quadratic.max())
    assert np.isfinite(found)
    assert found >= -quadratic.mean() - slack
    assert found <= np.sqrt(2.0) * np.linalg.norm(linear) - quadratic.min() + slack


@given(VECTORS, st.randoms(use_true_random=False))
def test_the_order_of_the_elements_and_signs_do_not_matter(weights, random):
    linear, quadratic = weights
    order = list(range(len(linear)))
    random.shuffle(order)
    signs = np.array([random.choice((-1.0, 1.0)) for _ in order])
    for log_mean in (log_mean_sphere, log_mean_normal):
        plain = float(log_mean(linear, quadratic))
        assert log_mean((signs * linear)[order], quadratic[order]) == pytest.approx(plain, rel=1e-9, abs=1e-9)


@given(VECTORS)
def test_rows_are_taken_by_themselves(weights):
    linear, quadratic = weights
    table = np.stack([linear, 0.0 * linear, -0.5 * linear])
    for log_mean in (log_mean_sphere, log_mean_normal):
        together = log_mean(table, quadratic)
        each = [float(log_mean(row, quadratic)) for row in table]
        assert together == pytest.approx(each, rel=1e-10, abs=1e-10)
