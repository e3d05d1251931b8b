from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.task.noise import KEYED, SAME_BAND, SAME_LAW, noise_of
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.model.velocity import STOP

# Windows of two seconds.
SCHEME = fleet_scheme(100)
SLOPE = ((0.5, 0.0), (5.0, -20.0))


def drawn(condition, scheme=SCHEME, ticks=1200, seed=5):
    """The noise (ticks, 3) that is added."""
    add = noise_of(scheme, condition, seed)
    return np.array([add(tick, STOP) for tick in range(ticks)])


def power_between(noise, low_hz, high_hz):
    hz = np.fft.rfftfreq(len(noise), 0.02)
    power = np.abs(np.fft.rfft(noise * np.hanning(len(noise))[:, None], axis=0)) ** 2
    return power[(hz > low_hz) & (hz < high_hz), :2].mean()


@pytest.mark.parametrize("condition", [SAME_BAND, SAME_LAW, KEYED])
def test_unkeyed_noise_is_as_loud_as_keyed_noise(condition):
    noise = np.concatenate([drawn(condition, seed=seed) for seed in range(5)])
    assert noise.std(axis=0) == pytest.approx([0.1, 0.1, 0.0], rel=0.04)


@pytest.mark.parametrize("condition", [SAME_BAND, SAME_LAW, KEYED])
def test_unkeyed_noise_has_the_spectrum_of_the_scheme(condition):
    sloped = drawn(condition, replace(SCHEME, spectrum=SLOPE))
    assert power_between(sloped, 0.6, 1.5) > 10.0 * power_between(sloped, 4.0, 4.9)
    assert power_between(sloped, 4.0, 4.9) > 3.0 * power_between(sloped, 7.0, 10.0)


def test_noise_of_the_same_law_has_its_windows():
    free, law, keyed = (
        np.mean(drawn(condition)[:, :2].reshape(12, 100, 2) ** 2, axis=1) / 0.1**2
        for condition in (SAME_BAND, SAME_LAW, KEYED)
    )
    assert law == pytest.approx(1.0, rel=1e-9)
    assert keyed == pytest.approx(1.0, rel=1e-9)
    assert free.std() > 0.1


def test_windows_of_an_ensemble_differ_in_power():
    noise = drawn(SAME_LAW, replace(SCHEME, power="ensemble"), ticks=3000)
    powers = np.mean(noise[:, :2].reshape(30, 100, 2) ** 2, axis=1) / 0.1**2
    assert powers.mean() == pytest.approx(1.0, abs=0.1)
    assert powers.std() == pytest.approx(1.0 / np.sqrt(10.0), rel=0.3)


def test_the_tones_of_the_same_law_change_with_the_window():
    noise = drawn(SAME_LAW)[:, 0].reshape(12, 100)
    correlations = np.corrcoef(noise)[~np.eye(12, dtype=bool)]
    assert np.abs(correlations).max() < 0.95
    tones = np.abs(np.fft.rfft(noise, axis=1))
    assert np.all(tones[:, [0, *range(11, 51)]] < 1e-9)
    assert np.all(tones[:, 1:11] > 0.0)


def test_windows_put_some_of_the_power_beyond_the_band():
    rolling = replace(SCHEME, schedule="rolling")
    shares = {
        condition: np.mean([_share_beyond(drawn(condition, rolling, seed=seed)) for seed in range(10)])
        for condition in (SAME_BAND, SAME_LAW, KEYED)
    }
    assert shares[SAME_BAND] < 1e-4
    assert shares[SAME_LAW] == pytest.approx(0.1, abs=0.02)
    assert shares[KEYED] == pytest.approx(0.1, abs=0.02)


def _share_beyond(noise):
    hz = np.fft.rfftfreq(len(noise), 0.02)
    power = np.abs(np.fft.rfft(noise[:, 0] * np.hanning(len(noise)))) ** 2
    return power[(hz < 0.45) | (hz > 5.05)].sum() / power.sum()
