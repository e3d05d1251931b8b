"""Presence of any message and of each symbol: valid for every recording, and stronger for a louder robot."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors.matched.correlate import prepare
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.significance.gains import all_levels
from mtm_audit.significance.likelihood import Hypotheses, weights
from mtm_audit.significance.message_evidence import weigh_message
from mtm_audit.significance.normaliser import log_mean_normal
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import FAKE_SECRET, key_of, robot_track, scheme_of
from tests.audit.significance.recorded import ONSET_S, prepared, secret, terms_of, tones_of, without_motion


def louder(scheme, sigma):
    return replace(scheme, channels=tuple(replace(channel, sigma=sigma) for channel in scheme.channels))


@pytest.mark.parametrize("seed", [0, 1])
def test_more_amplitude_is_more_evidence(seed):
    """The interference is fitted with the message in it, which must not whiten a loud one away."""
    found = []
    for sigma in (0.05, 0.1, 0.2, 0.4):
        key = key_of(louder(scheme_of(symbols=(2,), ticks=400), sigma))
        track = robot_track(key, "robot0", (2, 1), 8.8, onset_s=ONSET_S, seed=seed)
        decoding = decode_tracks([track], key, DecodeSettings(onset_s=ONSET_S))
        assert decoding.symbols == (2, 1)
        # The quietest may show too little of any message for its symbols to be weighed.
        found.append([decoding.evidence.nats, *(-np.inf if nats is None else nats for nats in decoding.symbol_nats)])
    assert np.all(np.diff(found, axis=0) > 0.0)


REPEATING = scheme_of(symbols=(2,), ticks=200, alphabet=2)


def drawn(terms, count=400):
    """Hypotheses under which the joint e-value of both positions varies enough to matter, and not too much to see."""
    rng = np.random.default_rng(4)
    sizes = (terms.timings.max() + 1, terms.plants.max() + 1, len(all_levels().magnitudes), len(terms.channel.turns))
    chosen = Hypotheses(*(rng.integers(0, size, count) for size in sizes))
    linear, quadratic = (
        part.sum(axis=1) for part in weights(terms.projections, all_levels(), terms.channel.turns, chosen)
    )
    second = log_mean_normal(2.0 * linear, 2.0 * quadratic) - 2.0 * log_mean_normal(linear, quadratic)
    variance = np.expm1(second.sum(axis=-1))
    fit = (variance > 0.5) & (variance < 3.0)
    return Hypotheses(chosen.timings[fit], chosen.plants[fit], chosen.levels[fit], chosen.turns[fit])


@cache
def presences(count=500):
    """E-values of any message, (keys, hypotheses), of keys that had no part in a motion whose positions look alike."""
    base = terms_of(REPEATING, Codebook(secret(0), REPEATING), prepared(), 4)
    terms = base.at(base.timing)
    chosen = drawn(terms)
    rows = []
    for number in range(count):
        tones = tones_of(REPEATING, number)
        own = np.stack([tones[row] for row in base.candidates])
        rows.append(replace(terms, channel=replace(base, tones=own)).exact_presence(chosen))
    return np.exp(rows)


def test_a_repeated_symbol_is_one_waveform_and_weighed_once():
    """Multiplied as if the two positions had waveforms of their own, their e-values would be far above one."""
    values = presences()
    assert values.shape[1] >= 10
    mixed = values.mean(axis=1)
    assert mixed.mean() <= 1.0 + 3.0 * mixed.std() / np.sqrt(len(mixed))
    means, errors = values.mean(axis=0), values.std(axis=0) / np.sqrt(len(values))
    assert np.all(means <= 1.0 + 4.5 * errors)


def test_a_message_of_one_symbol_twice_is_decoded():
    key = key_of(scheme_of(symbols=(2,), ticks=400))
    track = robot_track(key, "robot0", (2, 2), 16.8, onset_s=ONSET_S)
    decoding = decode_tracks([track], key, DecodeSettings(onset_s=ONSET_S))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (2, 2))


LARGE = scheme_of(symbols=(3,), ticks=300, alphabet=64)
SENT = (7, 40, 22)


@cache
def sent():
    """A recording of a robot that sends under the key."""
    track = robot_track(key_of(LARGE), "robot0", SENT, 12.8, onset_s=ONSET_S)
    motion = uniform_motion(glimpse_of_track(track), 5.0)
    return prepare(motion, fit_recording_noise([motion], [motion.velocities]), 0)


def ranked(*symbols_by_position):
    """Scores of six windows under which each position's candidates come in that order."""
    scores = np.zeros((6, 64))
    for window in range(6):
        for rank, symbol in enumerate(symbols_by_position[window % 3]):
            scores[window, symbol] = 10.0 - rank
    return scores


def test_what_was_sent_is_found_with_evidence_for_each_symbol():
    terms = terms_of(LARGE, Codebook(FAKE_SECRET, LARGE), sent(), 6, None, ranked(*([symbol] for symbol in SENT)))
    found = weigh_message([terms], [0.0], 3)
    assert tuple(item.symbol for item in found.symbols) == SENT
    assert min(item.nats for item in found.symbols) > 5.0
    assert found.presence_nats > 20.0
    assert found.channels_nats == {"robot0": found.presence_nats}


@pytest.mark.parametrize("share", [0.2, 0.02])
def test_a_candidate_that_was_not_sent_seldom_meets_its_bound(share):
    """The motion is the key's own message; each wrong candidate gets to e with probability 1 / e at most."""
    nats = wrong_nats(tuple(symbol for symbol in range(64) if symbol not in SENT))
    assert np.sum(nats >= np.log(2.0 / share)) <= stats.binom.isf(0.001, nats.size, share)


@cache
def wrong_nats(wrong, calls=12):
    """Evidence (calls, positions) of the better of two wrong candidates at each position, the true ones beside."""
    codebook, found = Codebook(FAKE_SECRET, LARGE), []
    for call in range(calls):
        pairs = [np.roll(wrong, -2 * call - 20 * place)[:2].tolist() for place in range(3)]
        scores = ranked(*([*pair, symbol] for pair, symbol in zip(pairs, SENT, strict=True)))
        message = weigh_message([terms_of(LARGE, codebook, sent(), 6, None, scores)], [0.0], 3)
        for item, pair in zip(message.symbols, pairs, strict=True):
            assert item.symbol in pair
        found.append([item.nats for item in message.symbols])
    return np.array(found)


def of_no_key(number=1, ready=None, positions=2):
    terms = terms_of(REPEATING, Codebook(secret(number), REPEATING), prepared() if ready is None else ready, 4)
    return weigh_message([terms], [0.0], positions)


def test_choosing_a_track_costs_what_it_costs():
    terms = terms_of(REPEATING, Codebook(secret(1), REPEATING), prepared(), 4)
    free, paid = (weigh_message([terms], [cost], 2) for cost in (0.0, -2.5))
    assert paid.presence_nats == pytest.approx(free.presence_nats - 2.5)
    assert paid.channels_nats == pytest.approx({name: nats - 2.5 for name, nats in free.channels_nats.items()})
    for dear, cheap in zip(paid.symbols, free.symbols, strict=True):
        assert dear.nats == pytest.approx(cheap.nats - 2.5)


def test_a_position_that_no_window_shows_has_no_evidence():
    assert of_no_key(positions=4).symbols[2:] == (None, None)


@pytest.mark.parametrize("seen", [True, False])
def test_no_motion_is_no_evidence_and_always_a_number(seen):
    found = of_no_key(ready=without_motion(prepared(), seen=seen))
    values = [found.presence_nats, *(item.nats for item in found.symbols)]
    assert np.all(np.isfinite(values))
    assert max(values) <= 1e-6


def test_a_channel_that_says_nothing_costs_the_others_little():
    """Each channel may be silent, with a prior; a silent one does not take away what another shows."""
    speaks = terms_of(LARGE, Codebook(FAKE_SECRET, LARGE), sent(), 6, None, ranked(*([symbol] for symbol in SENT)))
    silent = replace(terms_of(LARGE, Codebook(secret(3), LARGE), sent(), 6, None), name="robot1")
    alone = weigh_message([speaks], [0.0], 3, symbols_above_nats=np.inf)
    both = weigh_message([speaks, silent], [0.0, 0.0], 3, symbols_above_nats=np.inf)
    assert both.presence_nats > alone.presence_nats - 4.0
    assert both.channels_nats["robot0"] == pytest.approx(alone.channels_nats["robot0"])
    assert both.symbols == (None, None, None)


def test_the_hypothesis_of_one_channel_helps_another():
    """Two robots that play alike are more evidence together than the sum of what each says alone."""
    terms = terms_of(LARGE, Codebook(FAKE_SECRET, LARGE), sent(), 6, None, ranked(*([symbol] for symbol in SENT)))
    both = weigh_message([terms, replace(terms, name="robot1")], [0.0, 0.0], 3, symbols_above_nats=np.inf)
    assert both.presence_nats > sum(both.channels_nats.values())
