"""The search of a large alphabet takes short cuts; these are what it must not lose by them."""

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched import candidates, coherent, correlate, folding, relief, search
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.detectors.matched.rates import Rates
from mtm_audit.model.glimpse import glimpse_of_track
from tests.audit.moving_robot import key_of, robot_track, scheme_of

SYMBOLS = (117, 5, 299, 40)
KEY = key_of(scheme_of(symbols=(4,), ticks=4 * 150, alphabet=300))


def read(monkeypatch, whole, *, rate_scale=1.0, key=KEY, seconds=26.0):
    """A robot's reading, of an alphabet that counts as large above `whole` symbols; onset and clock are to be found."""
    for place in (candidates, coherent, search):
        monkeypatch.setattr(place, "WHOLE", whole)
    # Its interference is taken for a large alphabet's either way, so that the short cuts alone differ.
    monkeypatch.setattr(relief, "WHOLE", 64)
    monkeypatch.setattr(coherent, "_NEAR_A_CELL", 40)
    track = robot_track(KEY, "robot0", SYMBOLS, seconds, onset_s=0.7, rate_scale=rate_scale)
    observation = Observation(key.scheme.channels[0], glimpse_of_track(track))
    (found,) = MatchedDetector().read(key.codebook(), [], [observation], None)
    return found.reading


@pytest.mark.parametrize("rate_scale", [1.0, 1.012, 0.93])
def test_a_large_alphabet_s_message_is_found_at_any_clock(monkeypatch, rate_scale):
    plain = read(monkeypatch, 300, rate_scale=rate_scale)
    short = read(monkeypatch, 64, rate_scale=rate_scale)
    assert short.timing.rate_hz == pytest.approx(plain.timing.rate_hz, rel=2e-4)
    assert short.timing.rate_hz == pytest.approx(50.0 * rate_scale, rel=1e-3)
    assert np.array_equal(short.scores.argmax(axis=1), plain.scores.argmax(axis=1))
    # What is not looked at can only lower the evidence.
    assert plain.strength - 1.0 < short.strength < plain.strength + 0.01


@pytest.mark.parametrize("rate_scale", [0.85, 0.93, 1.043, 1.117])
def test_a_skimmed_alphabet_s_message_is_found_at_odd_clocks(monkeypatch, rate_scale):
    plain = read(monkeypatch, 64, rate_scale=rate_scale, seconds=40.0)
    skimmed_lags = []
    monkeypatch.setattr(search, "_SKIM_ABOVE", 64)
    monkeypatch.setattr(folding, "skimmed_by_lag", counted(folding.skimmed_by_lag, skimmed_lags))
    found = read(monkeypatch, 64, rate_scale=rate_scale, seconds=40.0)
    assert len(skimmed_lags) > 1
    assert found.timing.rate_hz == pytest.approx(50.0 * rate_scale, rel=1e-3)
    assert np.array_equal(found.scores.argmax(axis=1), plain.scores.argmax(axis=1))
    assert found.strength > 0.9 * plain.strength


def counted(function, calls):
    """The function, which notes that it was called."""

    def noting(*arguments):
        calls.append(arguments[-1])
        return function(*arguments)

    return noting


def test_skimming_looks_at_one_in_two_lags():
    rng = np.random.default_rng(3)
    heard, tones = heard_at_random(rng), rng.standard_normal((9, 2, 8)).astype(np.float32)
    whole = correlate.evidence_by_lag([[tones]], heard)
    skimmed = correlate.skimmed_by_lag([[tones]], heard, 2)
    assert skimmed.shape == whole.shape
    assert skimmed[..., ::2] == pytest.approx(whole[..., ::2], abs=1e-5)
    assert np.array_equal(skimmed[..., 1:-1:2], np.maximum(skimmed[..., :-2:2], skimmed[..., 2::2]))


@pytest.mark.parametrize(("count", "every"), [(41, 1), (41, 2), (39, 2), (13, 2), (41, 3), (7, 2)])
def test_no_rate_is_far_from_one_that_is_tried(count, every):
    rates = Rates(count, 0.4 / (count - 1), 50.0)
    tried = rates.others(every)
    left = set(range(count)) - set(rates.usual())
    assert set(tried) <= left
    assert all(min(abs(one - at) for at in tried) <= every / 2 for one in left)
    assert len(tried) <= len(left) / every + 2


def test_a_wrong_key_s_large_alphabet_shows_no_more(monkeypatch):
    other = key_of(KEY.scheme, b"one more fake secret, only tests")
    plain, short = read(monkeypatch, 300, key=other), read(monkeypatch, 64, key=other)
    assert short.strength < plain.strength + 0.01


def heard_at_random(rng, lags=50):
    """What might be heard on two axes with four tones."""
    return correlate.Heard(
        rng.standard_normal((2, 8, lags)).astype(np.float32),
        np.arange(1.0, 5.0),
        rng.uniform(0.1, 1.0, (2, 8)),
        np.full(8, 0.25),
        rng.uniform(0.0, 40.0, (2, lags)),
        50,
    )


def test_an_alphabet_in_blocks_has_the_evidence_of_the_whole(monkeypatch):
    rng = np.random.default_rng(0)
    heard = heard_at_random(rng)
    tones = rng.standard_normal((90, 2, 8)).astype(np.float32)
    whole = correlate.evidence_by_lag([[tones]], heard)
    monkeypatch.setattr(correlate, "_MOST_CORRELATED", 700)
    assert correlate.evidence_by_lag([[tones]], heard) == pytest.approx(whole, abs=1e-4)
