"""Evidence under a spectrum: the mean over keys stays one, since each tone's power counts as part of the response."""

from functools import cache

import numpy as np
import pytest

from mtm_audit.detectors.matched.projections import Places, project, shaped
from mtm_audit.significance.channel_terms import SHAPES
from mtm_audit.significance.gains import all_levels, orientations
from mtm_audit.significance.likelihood import Hypotheses, log_e, log_e_of, weights
from mtm_audit.significance.normaliser import log_mean_normal, log_mean_sphere
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import scheme_of
from tests.audit.significance.laws import assert_mean_is_one, assert_spread_is_the_law_s, most_passing
from tests.audit.significance.recorded import prepared, secret, terms_of, tones_of

LAWS = ("ensemble", "window")
# 20 dB from the loudest tone to the faintest.
STEEP = ((0.5, 0.0), (2.0, -14.0), (5.0, 6.0))
KEYS = 250
TURNS = orientations(2, 2)


def scheme(power, spectrum=STEEP):
    return scheme_of(symbols=(2,), ticks=200, alphabet=8, power=power, spectrum=spectrum)


@cache
def terms(power):
    own = terms_of(scheme(power), Codebook(secret(0), scheme(power)), prepared(), 4)
    return own.at(own.timing)


@cache
def tones(power):
    """What `channel_terms` makes of many keys' waveforms, all eight symbols of each: (groups, keys * M, axes, 2 K)."""
    chosen = scheme(power)
    found = [terms_of(chosen, Codebook(secret(number), chosen), prepared(), 4).tones for number in range(KEYS)]
    return np.concatenate(found, axis=1)


def hypotheses(power, count=120):
    rng = np.random.default_rng(8)
    own = terms(power)
    sizes = (own.timings.max() + 1, len(SHAPES.taps), len(all_levels().magnitudes), len(TURNS))
    return Hypotheses(*(rng.integers(0, size, count) for size in sizes))


@cache
def values(power):
    """Log e-values (hypotheses, groups, waveforms), and the exact variance (hypotheses, groups) of each e-value."""
    projections, chosen = terms(power).projections, hypotheses(power)
    found = log_e(projections, tones(power), all_levels(), TURNS, chosen, power)
    linear, quadratic = weights(projections, all_levels(), TURNS, chosen)
    log_mean = log_mean_normal if power == "ensemble" else log_mean_sphere
    second = (log_mean(2.0 * linear, 2.0 * quadratic) - 2.0 * log_mean(linear, quadratic)).sum(axis=-1)
    return found, np.expm1(second)


@pytest.mark.parametrize("power", LAWS)
def test_the_mean_over_keys_is_one(power):
    found, variance = values(power)
    assert_mean_is_one(found, variance)


@pytest.mark.parametrize("power", LAWS)
def test_the_spread_over_keys_is_what_the_law_says(power):
    found, variance = values(power)
    assert_spread_is_the_law_s(found, variance)


@pytest.mark.parametrize("power", LAWS)
@pytest.mark.parametrize("share", [0.1, 0.01, 0.001])
def test_large_values_are_as_rare_as_markov_says(power, share):
    found, _ = values(power)
    passed = (found >= -np.log(share)).sum(axis=-1)
    assert np.all(passed <= most_passing(found, share))


@pytest.mark.parametrize("power", LAWS)
def test_the_likelihood_is_that_of_the_tones_played(power):
    """Whether the spectrum is counted with the tones or with the response, motion and tones fit each other as well."""
    chosen = scheme(power)
    book = Codebook(secret(0), chosen)
    powers = np.tile(book.tone_powers(chosen.channels[0]), 2)
    starts_s = np.array([[0.4, 2.4]])
    tones_hz = book.bins(chosen.channels[0]) * 0.5
    bare = project(prepared(), Places(starts_s, np.array([0, 1]), SHAPES, 2.0, tones_hz))
    counted = shaped(bare, powers[: len(tones_hz)])
    # Levels of no relief: what is taken off the interference follows the response's power, spectrum included.
    places = Hypotheses(*(np.zeros(4, int), np.arange(4), np.array([2, 5, 8, 11]), np.array([0, 7, 20, 31])))
    played = np.stack([tones_of(chosen, 0)] * 2)
    linear, quadratic = weights(bare, all_levels(), TURNS, places)
    said = np.einsum("hgak,gcak->hgc", linear, played)
    said -= 0.5 * np.einsum("hgak,gcak->hgc", quadratic, played**2)
    log_mean = log_mean_normal if power == "ensemble" else log_mean_sphere
    said -= log_mean(linear * np.sqrt(powers), quadratic * powers).sum(axis=-1)[..., None]
    found = log_e_of(*weights(counted, all_levels(), TURNS, places), played / np.sqrt(powers), power)
    assert found == pytest.approx(said, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("power", LAWS)
def test_channel_terms_take_the_spectrum_off_the_tones(power):
    plain = terms_of(scheme(power, None), Codebook(secret(0), scheme(power, None)), prepared(), 4)
    assert terms(power).channel.tones == pytest.approx(plain.tones, abs=1e-6)
    assert plain.powers.tolist() == [1.0] * len(plain.powers)
    assert np.ptp(terms(power).channel.powers) > 1.0
