from dataclasses import fields

import numpy as np
import pytest

from mtm_audit.detectors.matched.plants import (
    COARSE,
    FINE,
    MEMORY_S,
    TAP_S,
    Plants,
    joined,
    notched,
    plant_family,
    returning,
    tone_responses,
)

TONES_HZ = np.array([0.5, 1.7, 4.6])
LENGTH_S = 2.0
# Those whose response the quadrature below knows.
UNNOTCHED = Plants(**{field.name: getattr(FINE, field.name)[np.isinf(FINE.notches_hz)] for field in fields(Plants)})
STEP_S = 0.0005


def by_quadrature(delay_s, lag_s, return_s, tone_hz, instant_s):
    """The convolution integral of a delayed first-order lag, and a high pass, with a tone from 0 to LENGTH_S."""
    ago_s = np.arange(0.0, MEMORY_S, STEP_S) + STEP_S / 2.0
    kernel = np.where(ago_s > delay_s, np.exp(-(ago_s - delay_s) / lag_s), 0.0)
    kernel /= kernel.sum()
    if np.isfinite(return_s):
        kernel = kernel - np.convolve(kernel, np.exp(-ago_s / return_s) * STEP_S / return_s)[: len(kernel)]
    played_s = instant_s - ago_s
    sounding = (played_s >= 0.0) & (played_s < LENGTH_S)
    return np.sum(kernel * np.exp(2j * np.pi * tone_hz * played_s) * sounding)


@pytest.mark.parametrize(
    "instants_s",
    [
        pytest.param([1.0, 1.33, 1.98], id="steady state"),
        pytest.param([0.005, 0.06, 0.13, 0.31], id="start"),
        pytest.param([2.02, 2.1, 2.33, 2.49], id="tail"),
    ],
)
@pytest.mark.parametrize("family", [COARSE, UNNOTCHED], ids=["coarse", "fine"])
def test_tones_through_plants_are_the_convolution_integral(family, instants_s):
    heard = tone_responses(family, TONES_HZ, np.array(instants_s), LENGTH_S)
    assert heard.shape == (len(family.taps), 3, len(instants_s))
    plants = zip(family.delays_s, family.lags_s, family.returns_s, strict=True)
    for plant, times_s in enumerate(plants):
        for tone, tone_hz in enumerate(TONES_HZ):
            expected = [by_quadrature(*times_s, tone_hz, instant_s) for instant_s in instants_s]
            # Taps every hundredth of a second: the first one of a short lag holds its energy half a tap late.
            assert np.abs(heard[plant, tone] - expected).max() < (0.02 if np.isinf(times_s[2]) else 0.05)


def test_before_the_window_and_long_after_it_nothing_sounds():
    heard = tone_responses(FINE, TONES_HZ, np.array([-0.3, -0.01, LENGTH_S + MEMORY_S + TAP_S]), LENGTH_S)
    assert np.abs(heard).max() < 1e-12


def test_constant_commands_are_followed_after_delay_and_lag():
    family = plant_family(np.array([0.1]), np.array([0.05]))
    heard = tone_responses(family, np.array([0.0]), np.array([0.05, 0.099, 0.9]), LENGTH_S)[0, 0]
    assert heard.real == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_a_family_holds_every_pair_once():
    family = plant_family(np.array([0.02, 0.1]), np.array([0.05, 0.1, 0.4]))
    assert list(zip(family.delays_s, family.lags_s, strict=True)) == [
        (0.02, 0.05), (0.02, 0.1), (0.02, 0.4), (0.1, 0.05), (0.1, 0.1), (0.1, 0.4)
    ]  # fmt: skip
    assert family.taps.sum(axis=1) == pytest.approx(1.0)
    assert np.all(family.taps[3:, : round(0.1 / TAP_S)] == 0.0)


def test_what_returns_follows_at_once_and_not_for_good():
    plain = plant_family(np.array([0.02]), np.array([0.06]))
    family = returning(plain, (0.1, 0.3))
    assert family.returns_s.tolist() == [0.1, 0.3]
    heard = tone_responses(family, np.array([0.0]), np.array([0.1, 0.79]), LENGTH_S)[:, 0].real
    assert np.all(heard[:, 0] > 0.2)
    assert np.all(np.abs(heard[:, 1]) < [0.02, 0.12])
    assert family.taps[0] == pytest.approx(returning(plain, (0.1,)).taps[0])


def test_what_is_notched_lacks_that_part_of_the_band():
    plain = plant_family(np.array([0.02]), np.array([0.06]))
    family = notched(plain, (1.0, 3.2), 0.8)
    assert family.notches_hz.tolist() == [1.0, 3.2]
    settled = np.array([MEMORY_S])
    heard = np.abs(tone_responses(family, np.array([1.0, 3.2]), settled, LENGTH_S)[:, :, 0])
    whole = np.abs(tone_responses(plain, np.array([1.0, 3.2]), settled, LENGTH_S)[0, :, 0])
    assert np.all(np.diag(heard) < 0.1 * whole)
    assert np.all(heard[::-1].diagonal() > 0.6 * whole)


def test_joined_families_are_one_after_the_other():
    plain = plant_family(np.array([0.02, 0.1]), np.array([0.05]))
    both = joined(plain, returning(plain, (0.2,)))
    assert both.delays_s.tolist() == [0.02, 0.1, 0.02, 0.1]
    assert both.returns_s.tolist() == [np.inf, np.inf, 0.2, 0.2]
    assert len(both.taps) == len(COARSE.taps[:4])
