"""The search of a large alphabet takes short cuts; these are what it must not lose by them."""

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched import candidates, coherent, correlate, search
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from tests.audit.moving_robot import key_of, robot_track, scheme_of

SYMBOLS = (117, 5, 299, 40)
KEY = key_of(scheme_of(symbols=(4,), ticks=4 * 150, alphabet=300))


def read(monkeypatch, whole, *, rate_scale=1.0, key=KEY):
    """A robot's reading, of an alphabet that counts as large above `whole` symbols; onset and clock are to be found."""
    for place in (candidates, coherent, search):
        monkeypatch.setattr(place, "WHOLE", whole)
    monkeypatch.setattr(coherent, "_NEAR_A_CELL", 40)
    track = robot_track(KEY, "robot0", SYMBOLS, 26.0, onset_s=0.7, rate_scale=rate_scale)
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


def test_a_wrong_key_s_large_alphabet_shows_no_more(monkeypatch):
    other = key_of(KEY.scheme, b"one more fake secret, only tests")
    plain, short = read(monkeypatch, 300, key=other), read(monkeypatch, 64, key=other)
    assert short.strength < plain.strength + 0.01


def test_an_alphabet_in_blocks_has_the_evidence_of_the_whole(monkeypatch):
    rng = np.random.default_rng(0)
    heard = correlate.Heard(
        rng.standard_normal((2, 8, 50)).astype(np.float32),
        np.arange(1.0, 5.0),
        rng.uniform(0.1, 1.0, (2, 8)),
        np.full(8, 0.25),
        rng.uniform(0.0, 40.0, (2, 50)),
        50,
    )
    tones = rng.standard_normal((90, 2, 8)).astype(np.float32)
    whole = correlate.evidence_by_lag([[tones]], heard)
    monkeypatch.setattr(correlate, "_MOST_CORRELATED", 700)
    assert correlate.evidence_by_lag([[tones]], heard) == pytest.approx(whole, abs=1e-4)
