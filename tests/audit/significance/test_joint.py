"""Evidence of several recordings of one message."""

from functools import cache

import numpy as np
import pytest
from scipy import stats

from mtm_audit.significance.joint import Witness, weigh_together
from mtm_audit.significance.message_evidence import MessageEvidence, weigh_message
from mtm_audit.significance.weighed_channel import weighed
from mtm_onboard.protocol import Codebook
from tests.audit.significance.recorded import prepared, secret, terms_of
from tests.audit.significance.test_sequence import FIXED, ROLLING

KEYS = 10
NOTHING = MessageEvidence(-np.inf, {}, (None,) * 3)


def witness(scheme, number, ahead=0, seconds=10.0):
    scores = np.random.default_rng(number).standard_normal((6, 4))
    terms = terms_of(scheme, Codebook(secret(number), scheme), prepared(seconds), 6, scores=scores)
    played = np.zeros_like(terms.positions) if terms.shared else terms.span.numbers[terms.groups] + ahead
    return Witness(item=weighed(terms, 0.0), axes=("vx", "vy"), positions=terms.positions, waveforms=played)


@cache
def copied(scheme):
    """Evidence of one recording with its own copy, under keys that had no part in it."""
    return [
        weigh_together([NOTHING, NOTHING], {"robot0": [witness(scheme, number)] * 2}, range(1))
        for number in range(KEYS)
    ]


@pytest.mark.parametrize("scheme", [FIXED, ROLLING], ids=["fixed", "rolling"])
def test_a_copy_makes_no_message_of_a_key_without_a_part(scheme):
    presence = np.array([found.presence_nats for found in copied(scheme)])
    for share in (0.3, 0.05):
        assert np.sum(presence >= np.log(1.0 / share)) <= stats.binom.isf(0.001, KEYS, share)


@pytest.mark.parametrize("scheme", [FIXED, ROLLING], ids=["fixed", "rolling"])
def test_a_copy_makes_no_symbol_of_a_key_without_a_part(scheme):
    """Of M candidates the best has at most M times the mean, which is 1 at most."""
    values = np.exp([item.nats for found in copied(scheme) for item in found.symbols]) / scheme.alphabet_size
    assert values.mean() <= 1.0 + 4.0 * values.std() / np.sqrt(len(values))


def test_a_recording_with_no_second_one_keeps_what_it_says():
    own = witness(ROLLING, 3)
    alone = weigh_message([own.item.channel], [0.0], 3)
    both = weigh_together([alone], {"robot0": [own]}, range(3))
    assert both.presence_nats >= alone.presence_nats - np.log(2.0) - 1e-9
    for place in range(3):
        assert both.symbols[place].nats >= alone.symbols[place].nats - np.log(2.0) - 1e-9


def test_a_position_that_nothing_shows_stays_open():
    assert weigh_together([NOTHING], {"robot0": [witness(ROLLING, 4)]}, range(4)).symbols[3] is None
