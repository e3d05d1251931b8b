import numpy as np
import pytest
from scipy.signal import welch

from hil.plants.interference import Gait, Slip, Sum, slip_density

STEP_S = 0.01


def slip(axes=2000, seed=2):
    return Slip(STEP_S, np.full(axes, 0.04), 0.1, np.random.default_rng(seed))


def test_slip_is_stationary_as_asked():
    noise = slip().advance(400)
    assert noise[[0, -1]].std(axis=1) == pytest.approx([0.04, 0.04], rel=0.06)
    later = 10
    assert np.mean(noise[:-later] * noise[later:]) / noise.var() == pytest.approx(np.exp(-1), abs=0.02)


def test_slip_goes_on_where_it_ended():
    source = slip()
    noise = np.concatenate([source.advance(200), source.advance(200)])
    assert np.mean(noise[195:200] * noise[205:210]) / 0.04**2 == pytest.approx(np.exp(-1), abs=0.05)
    assert noise[200].std() == pytest.approx(0.04, rel=0.06)


def test_slip_may_differ_by_axis():
    noise = Slip(STEP_S, (0.1, 0.0), 0.1, np.random.default_rng(1)).advance(5000)
    assert noise.std(axis=0) == pytest.approx([0.1, 0.0], rel=0.2)


def test_a_gait_has_its_power_at_the_stride_and_its_harmonics():
    gait = Gait(STEP_S, 1.5, 0.1, np.random.default_rng(3))
    sway = np.concatenate([gait.advance(2500), gait.advance(3500)])
    spectrum = np.abs(np.fft.rfft(sway[:, 1])) ** 2
    frequencies_hz = np.fft.rfftfreq(6000, STEP_S)
    near = np.abs((frequencies_hz + 0.75) % 1.5 - 0.75) < 0.5
    assert spectrum[1:][near[1:]].sum() > 0.85 * spectrum[1:].sum()
    assert sway[:, 0].std() == pytest.approx(0.1 / np.sqrt(2), rel=0.15)
    assert np.abs(np.diff(sway, axis=0)).max() < 0.06


def test_sources_together_add_up():
    both = Sum(slip(3, 1), slip(3, 2)).advance(50)
    assert both == pytest.approx(slip(3, 1).advance(50) + slip(3, 2).advance(50))


def test_the_density_of_slip_is_that_of_its_noise():
    noise = slip(axes=400).advance(2000)
    hz, measured = welch(noise, 1.0 / STEP_S, nperseg=500, axis=0)
    # Steps of 10 ms fold some of what is higher into the higher of these.
    near = (hz > 0.4) & (hz < 3.0)
    assert measured[near].mean(axis=1) == pytest.approx(slip_density(0.04, 0.1, hz[near]), rel=0.05)
