"""A position's candidates weighed at the timing that the other positions show: for nothing, and as valid as before."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched.correlate import prepare
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.significance.channel_terms import channel_terms
from mtm_audit.significance.message_evidence import weigh_message
from mtm_onboard.protocol import Codebook, MtmError
from tests.audit.moving_robot import FAKE_SECRET, OTHER_SECRET, key_of, robot_track, scheme_of
from tests.audit.significance.recorded import ONSET_S, secret, terms_of
from tests.audit.significance.test_message_evidence import ranked

ROLLING = scheme_of(symbols=(3,), ticks=600, alphabet=64, schedule="rolling")
SMALL = scheme_of(symbols=(3,), ticks=300, alphabet=4, schedule="rolling")
SENT = (7, 40, 22)
BOUNDS = OnsetRange(ONSET_S - 20.0, ONSET_S + 20.0)


@cache
def sent(seed=0):
    """A recording of a robot that sends under the key."""
    track = robot_track(key_of(ROLLING), "robot0", SENT, 24.8, onset_s=ONSET_S, seed=seed)
    motion = uniform_motion(glimpse_of_track(track), 5.0)
    return prepare(motion, fit_recording_noise([motion], [motion.velocities]), 0)


def terms(*symbols_by_position, codebook=None, seed=0, onset=BOUNDS):
    book = Codebook(FAKE_SECRET, ROLLING) if codebook is None else codebook
    return terms_of(ROLLING, book, sent(seed), 6, onset, ranked(*symbols_by_position))


class Exchanged(Codebook):
    """A codebook whose waveforms at one position are those of another key."""

    def __init__(self, position):
        super().__init__(FAKE_SECRET, ROLLING)
        self.position, self.other = position, Codebook(OTHER_SECRET, ROLLING)

    def tones(self, channel, number, symbols=None):
        if number % 3 == self.position:
            return self.other.tones(channel, number, symbols)
        return super().tones(channel, number, symbols)


FOUND = Timing(ONSET_S, ROLLING.rate_hz)
NUMBERS = np.arange(6)


@pytest.mark.parametrize("position", range(3))
def test_a_position_s_own_waveforms_have_no_say(position):
    told, exchanged, of_another_key = (
        terms(*([symbol] for symbol in SENT), codebook=book).others.told(position, FOUND, NUMBERS)
        for book in (None, Exchanged(position), Codebook(OTHER_SECRET, ROLLING))
    )
    assert told == exchanged
    assert told != of_another_key


@pytest.mark.parametrize("position", range(3))
def test_other_positions_find_when_the_message_began(position):
    told = terms(*([symbol] for symbol in SENT)).others.told(position, FOUND, NUMBERS)
    timing, log_weight = told.timings[0]
    # A robot follows a little later than it is told.
    assert timing.rate_hz == ROLLING.rate_hz
    assert ONSET_S - 0.1 <= timing.onset_s <= ONSET_S + 0.3
    assert log_weight > np.log(0.4)
    assert told.sure > 0.8


@pytest.mark.parametrize("position", range(3))
def test_weights_of_all_timings_add_up_to_one_at_most(position):
    others = terms(*([symbol] for symbol in SENT)).others
    step_s = 0.5 * sent().motion.step_s
    starts_s = sent().motion.start_s + np.arange(-150, 151) * step_s
    nearest = [others.told(position, Timing(start_s, ROLLING.rate_hz), NUMBERS).timings[-1] for start_s in starts_s]
    weights = {timing: np.exp(log_weight) for timing, log_weight in nearest}
    assert 0.9 < sum(weights.values()) <= 1.0 + 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_search_that_others_made_costs_a_symbol_nothing(seed):
    told = terms(*([symbol] for symbol in SENT), seed=seed)
    free, paid = (weigh_message([each], [0.0], 3) for each in (told, replace(told, others=None)))
    for cheap, dear, symbol in zip(free.symbols, paid.symbols, SENT, strict=True):
        assert cheap.symbol == dear.symbol == symbol
        assert cheap.nats > dear.nats + 2.0
    assert free.presence_nats == paid.presence_nats


def test_windows_that_another_timing_shows_are_not_weighed():
    """Which windows show a position must not follow from a timing that its candidate had a say in."""
    others = terms(*([symbol] for symbol in SENT)).others
    assert others.told(1, FOUND, NUMBERS).covers
    assert others.told(1, FOUND, NUMBERS[1:]).timings == ()
    far = others.told(1, Timing(ONSET_S + 1.0, ROLLING.rate_hz), NUMBERS)
    assert not far.covers


@pytest.mark.parametrize("share", [0.2, 0.02])
def test_a_wrong_candidate_seldom_meets_its_bound(share):
    """The motion is the key's own message; each wrong candidate gets to e with probability 1 / e at most."""
    nats = wrong_nats()
    assert np.sum(nats >= np.log(2.0 / share)) <= stats.binom.isf(0.001, nats.size, share)


@cache
def wrong_nats(calls=8):
    """Evidence (calls, positions) of the better of two wrong candidates at each position, the true ones beside."""
    wrong, found = tuple(symbol for symbol in range(64) if symbol not in SENT), []
    for call in range(calls):
        pairs = [np.roll(wrong, -2 * call - 20 * place)[:2].tolist() for place in range(3)]
        told = terms(*([*pair, symbol] for pair, symbol in zip(pairs, SENT, strict=True)))
        message = weigh_message([told], [0.0], 3)
        for item, pair in zip(message.symbols, pairs, strict=True):
            assert item.symbol in pair
        found.append([item.nats for item in message.symbols])
    return np.array(found)


@pytest.mark.slow
def test_keys_that_had_no_part_get_no_symbol_by_a_search():
    """Of M candidates the best has at most M times the mean, which is 1 at most; each key searches the timing."""
    track = robot_track(key_of(SMALL, OTHER_SECRET), "robot0", (1, 2, 3), 7.0, onset_s=ONSET_S)
    channel, bounds, values = SMALL.channels[0], OnsetRange(ONSET_S - 2.0, ONSET_S + 2.0), []
    for number in range(30):
        codebook = Codebook(secret(number), SMALL)
        (read,) = MatchedDetector().read(codebook, [], [Observation(channel, glimpse_of_track(track))], bounds)
        if isinstance(read, MtmError):
            continue
        told = channel_terms(codebook, channel, read, bounds, apart=False)
        values += [item.nats for item in weigh_message([told], [0.0], 3).symbols if item is not None]
    e_values = np.exp(values) / SMALL.alphabet_size
    assert len(e_values) >= 40
    assert e_values.mean() <= 1.0 + 4.0 * e_values.std() / np.sqrt(len(e_values))


@pytest.mark.parametrize(
    ("scheme", "onset"),
    [
        (scheme_of(symbols=(3,), ticks=300, alphabet=64), None),
        (ROLLING, ONSET_S),
        (scheme_of(symbols=(1,), ticks=100, alphabet=64, schedule="rolling"), BOUNDS),
    ],
    ids=["one codebook", "known onset", "one position"],
)
def test_only_fresh_waveforms_of_other_positions_have_a_say(scheme, onset):
    scores = np.zeros((6, 64))
    assert terms_of(scheme, Codebook(FAKE_SECRET, scheme), sent(), 6, onset, scores).others is None
