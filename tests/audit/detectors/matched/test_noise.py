import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from mtm_audit.detectors.matched.noise import (
    fit_noise,
    fit_noise_by_axis,
    model_order,
    power_response,
    whitened,
    whitened_from_silence,
)

POLES = np.array([1.0, -0.8, 0.4])


def autoregressive(rng, count, scale=1.0):
    return signal.lfilter([1.0], POLES, scale * rng.standard_normal(count))


def all_seen(count):
    return np.ones(count, dtype=bool)


@given(st.integers(0, 2**32 - 1), st.integers(0, 8), st.integers(1, 3))
def test_whitening_is_a_linear_filter_less_its_first_samples(seed, order, rows):
    rng = np.random.default_rng(seed)
    taps, signals = np.concatenate([[1.0], rng.standard_normal(order)]), rng.standard_normal((rows, 40))
    assert whitened(signals, taps) == pytest.approx(signal.lfilter(taps, [1.0], signals, axis=-1)[:, order:])


@given(st.integers(0, 2**32 - 1), st.integers(0, 16), st.integers(1, 150), st.data())
def test_whitening_from_silence_has_zeros_before(seed, order, cells, data):
    history = data.draw(st.integers(max(0, order - cells), order))
    rng = np.random.default_rng(seed)
    taps, signals = np.concatenate([[1.0], rng.standard_normal(order)]), rng.standard_normal((2, 3, cells))
    silent = np.concatenate([np.zeros((2, 3, history)), signals], axis=2)
    assert whitened_from_silence(signals, history, taps) == pytest.approx(whitened(silent, taps))


@given(st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=8))
def test_the_power_response_is_that_of_the_filter(taps):
    frequencies = np.linspace(0.0, 0.5, 9)
    response = signal.freqz(taps, worN=2 * np.pi * frequencies)[1]
    assert power_response(np.array(taps), frequencies) == pytest.approx(np.abs(response) ** 2, abs=1e-12)


def test_an_autoregression_is_recovered_with_each_axis_s_scale():
    rng = np.random.default_rng(1)
    signals = [np.stack([autoregressive(rng, 4000), autoregressive(rng, 4000, scale=5.0)])]
    model = fit_noise(signals, [all_seen(4000)], order=4)
    assert model.filters[0][0] == pytest.approx([*POLES, 0.0, 0.0], abs=0.05)
    # A Student-t fit reads the spread of Gaussian innovations a little low.
    assert model.scales[0] == pytest.approx([1.0, 5.0], rel=0.2)
    assert model.order == 4


def test_outliers_are_doubted_and_do_not_bend_the_filter():
    rng = np.random.default_rng(2)
    clean = autoregressive(rng, 3000)
    struck = rng.choice(np.arange(100, 2900), 60, replace=False)
    innovations = np.zeros(3000)
    innovations[struck] = 40.0 * rng.choice([-1.0, 1.0], 60)
    observed = clean + signal.lfilter([1.0], POLES, innovations)
    model = fit_noise([observed[None]], [all_seen(3000)], order=4)
    assert model.filters[0][0, :3] == pytest.approx(POLES, abs=0.05)
    assert model.scales[0][0] < 1.5
    assert np.median(model.weights[0][0, struck]) < 0.05
    assert np.median(np.delete(model.weights[0][0, 4:], struck)) > 0.8


@given(st.integers(0, 150), st.integers(1, 60))
def test_samples_with_a_gap_in_their_history_weigh_nothing(first, length):
    rng, seen = np.random.default_rng(3), all_seen(250)
    seen[first : first + length] = False
    observed = np.where(seen, autoregressive(rng, 250), 0.0)[None]
    model = fit_noise([observed], [seen], order=4)
    expected = np.array([number >= 4 and seen[number - 4 : number + 1].all() for number in range(250)])
    assert np.array_equal(model.weights[0][0] > 0.0, expected)


def test_a_gap_s_zeros_do_not_bend_the_filter():
    whole, seen = autoregressive(np.random.default_rng(4), 4000), np.arange(4000) % 25 >= 5
    gapped = fit_noise([np.where(seen, whole, 0.0)[None]], [seen], order=4)
    whole_filters = fit_noise([whole[None]], [all_seen(4000)], order=4).filters[0]
    assert gapped.filters[0] == pytest.approx(whole_filters, abs=0.03)


def test_a_body_that_stands_still_has_a_model_without_faults():
    model = fit_noise([np.zeros((2, 300))], [all_seen(300)], order=4)
    assert np.all(np.isfinite(model.filters[0]))
    assert np.all(model.scales[0] > 0.0)


def test_short_recordings_get_short_filters():
    assert [model_order(samples) for samples in (10, 450, 650, 10_000)] == [4, 4, 6, 8]


def gait(rng, count, cells_a_step=13.3):
    """A swing of several harmonics whose phase wanders, as of legs."""
    phase = 2.0 * np.pi / cells_a_step * np.arange(count) + np.cumsum(0.03 * rng.standard_normal(count))
    return sum(np.sin(order * phase + order) / order for order in (1, 2, 3)) + 0.1 * rng.standard_normal(count)


def test_an_axis_with_a_gait_gets_a_longer_filter_of_its_own():
    rng = np.random.default_rng(4)
    signals, seen = [np.stack([gait(rng, 1200), autoregressive(rng, 1200)])], [all_seen(1200)]
    shared, own = fit_noise(signals, seen, order=4), fit_noise_by_axis(signals, seen, order=4)
    assert own.order == 16
    assert own.scales[0][0] < 0.6 * shared.scales[0][0]
    assert own.filters[0].shape == (2, 17)
    assert np.all(own.weights[0][:, :16] == 0.0)


def test_axes_alike_share_one_filter():
    rng = np.random.default_rng(5)
    signals = [np.stack([autoregressive(rng, 800), autoregressive(rng, 800, scale=3.0)]) for _ in range(3)]
    seen = [all_seen(800)] * 3
    shared, own = fit_noise(signals, seen, order=4), fit_noise_by_axis(signals, seen, order=4)
    assert own.order == 4
    assert all(np.array_equal(one, other) for one, other in zip(own.filters, shared.filters, strict=True))


def test_a_short_axis_has_no_order_of_its_own():
    rng = np.random.default_rng(6)
    own = fit_noise_by_axis([gait(rng, 100)[None]], [all_seen(100)], order=4)
    assert own.order == 4
