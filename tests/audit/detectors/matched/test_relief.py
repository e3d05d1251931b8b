import numpy as np
import pytest

from mtm_audit.detectors.matched import relief as module
from mtm_audit.detectors.matched.correlate import Heard
from mtm_audit.detectors.matched.relief import Relief, relief_of

WIDTH = 12


def case(observed, axes, starts, seed=0):
    """A relief, what was heard in 3 windows of 4 hypotheses, the weights of their cells, and gains."""
    rng = np.random.default_rng(seed)
    power = rng.uniform(0.001, 0.01, (observed, axes)).astype(np.float32)
    relief = Relief(power, rng.uniform(0.1, 1.0, (observed, WIDTH)), rng.uniform(0.05, 0.1, WIDTH), 100, 0.8)
    columns = rng.normal(0.0, 5.0, (4, 3, observed, WIDTH)).astype(np.float32)
    weights, gains = rng.uniform(0.0, 90.0, (4, 3, observed)), rng.standard_normal((4, starts, observed * axes))
    return relief, columns, weights, gains.astype(np.float32)


@pytest.mark.parametrize(("observed", "axes", "starts"), [(1, 1, 2), (2, 2, 8), (2, 3, 1), (3, 2, 4)])
@pytest.mark.parametrize("together", [1, 1 << 20], ids=["apart", "together"])
def test_chance_shows_the_sum_over_its_tones(monkeypatch, observed, axes, starts, together):
    monkeypatch.setattr(module, "_MOST_AT_ONCE", together)
    relief, columns, weights, gains = case(observed, axes, starts)
    found = relief.by_chance(columns, weights, gains)
    pairs = gains.reshape(4, starts, observed, axes)
    quieter = relief.factors(gains).reshape(pairs.shape)
    linear = np.einsum("hsoa,hwok->hwsak", pairs * quieter, columns)
    quadratic = np.einsum("hsoa,hwo,ok->hwsak", 0.5 * pairs**2 * quieter, weights, relief.steady)
    grown = 1.0 + quadratic * relief.spread
    assert found.shape == (4, 3, starts)
    assert found == pytest.approx(
        0.5 * np.sum(linear**2 * relief.spread / grown - np.log(grown), axis=(3, 4)), rel=1e-5, abs=1e-4
    )


@pytest.mark.parametrize(("count", "quieter"), [(64, False), (2048, True)])
def test_only_a_large_alphabet_makes_the_interference_quieter(count, quieter):
    rng = np.random.default_rng(2)
    heard = Heard(
        rng.standard_normal((2, WIDTH, 9)).astype(np.float32), np.arange(1.0, 7.0), np.full((2, WIDTH), 0.5),
        np.full(WIDTH, 1 / 6), np.full((2, 9), 90.0), 100,
    )  # fmt: skip
    tones = (0.4 * rng.standard_normal((count, 2, WIDTH))).astype(np.float32)
    factors = relief_of(heard, tones).factors(np.full((1, 1, 4), 0.3, dtype=np.float32))
    assert np.all(factors > 1.0) if quieter else np.all(factors == 1.0)


def test_chance_shows_the_mean_over_normal_waveforms():
    relief, columns, weights, gains = case(1, 1, 1)
    columns, weights, gains = 0.1 * columns, 0.1 * weights, 0.3 * gains
    tones = np.random.default_rng(1).standard_normal((100_000, WIDTH)) * np.sqrt(relief.spread)
    factor = relief.factors(gains)
    for hypothesis, window in ((0, 0), (3, 2)):
        gain, quieter = gains[hypothesis, 0, 0], factor[hypothesis, 0, 0]
        pulled = gain * quieter * (tones @ columns[hypothesis, window, 0])
        spent = 0.25 * gain**2 * quieter * weights[hypothesis, window, 0] * (tones**2 @ relief.steady[0])
        mean = np.log(np.mean(np.exp(pulled - spent)))
        assert relief.by_chance(columns, weights, gains)[hypothesis, window, 0] == pytest.approx(mean, abs=0.02)
