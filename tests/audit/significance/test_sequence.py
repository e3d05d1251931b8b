"""The e-value of a whole message, position by position."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from mtm_audit.significance.sequence import continued, sequences
from mtm_audit.significance.weighed_channel import weighed
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import scheme_of
from tests.audit.significance.recorded import prepared, secret, terms_of

FIXED = scheme_of(symbols=(3,), ticks=240, alphabet=4)
ROLLING = replace(FIXED, schedule="rolling")


@cache
def nats(scheme, keys=30):
    """The log e-value of the likeliest messages under keys that had no part in the recording."""
    found = []
    for number in range(keys):
        scores = np.random.default_rng(number).standard_normal((6, 4))
        terms = terms_of(scheme, Codebook(secret(number), scheme), prepared(), 6, scores=scores)
        found.append(logsumexp([message.nats for message in sequences(weighed(terms, 0.0))]))
    return np.array(found)


@pytest.mark.parametrize("scheme", [FIXED, ROLLING], ids=["fixed", "rolling"])
def test_keys_without_a_part_in_it_seldom_show_much(scheme):
    for share in (0.3, 0.05):
        assert np.sum(nats(scheme) >= np.log(1.0 / share)) <= stats.binom.isf(0.001, len(nats(scheme)), share)


@pytest.mark.parametrize("scheme", [FIXED, ROLLING], ids=["fixed", "rolling"])
def test_the_mean_over_keys_is_at_most_one(scheme):
    values = np.exp(nats(scheme))
    assert values.mean() <= 1.0 + 4.0 * values.std() / np.sqrt(len(values))


def test_a_symbol_that_comes_again_adds_nothing_if_fixed():
    """Its waveform has been used; taken for a new one it would count twice."""
    scores = np.tile(np.array([3.0, 2.0, 1.0, 0.0]), (6, 1))
    terms = terms_of(FIXED, Codebook(secret(1), FIXED), prepared(), 6, scores=scores)
    item = weighed(terms, 0.0)
    repeated = np.zeros_like(item.exact)
    repeated[:, :, 0] = 50.0
    table = replace(item)
    object.__setattr__(table, "exact", repeated)
    object.__setattr__(table, "by_group", item.by_group)
    (message,) = sequences(table)
    assert message.columns.tolist() == [0, 0, 0]
    alone = terms_of(FIXED, Codebook(secret(1), FIXED), prepared(), 6, scores=scores)
    first = np.logaddexp(item.by_group[:, 0, 0] + np.log(0.9 / 4), np.log(0.1))
    rest = 2.0 * np.logaddexp(np.log(0.9 / 4), np.log(0.1))
    expected = np.logaddexp.reduce(first + rest + item.chosen[1])
    assert message.nats == pytest.approx(expected)
    assert alone.shared


def test_a_second_part_is_weighed_by_what_the_first_has_shown():
    """Its symbols and its timing are settled, and only its plant and loudness are open."""
    scores = np.random.default_rng(0).standard_normal((6, 4))
    terms = terms_of(ROLLING, Codebook(secret(2), ROLLING), prepared(), 6, scores=scores)
    first = sequences(weighed(terms, 0.0))[0]
    values = []
    for number in range(30):
        other = terms_of(ROLLING, Codebook(secret(100 + number), ROLLING), prepared(), 6, scores=scores)
        values.append(continued(first, other, other.at(terms.timing)))
    assert np.sum(np.array(values) >= np.log(10.0)) <= stats.binom.isf(0.001, len(values), 0.1)


def test_what_all_parts_say_is_weighed_where_one_differs():
    scores = np.tile(np.array([3.0, 2.0, 1.0, 0.0]), (6, 1))
    item = weighed(terms_of(ROLLING, Codebook(secret(1), ROLLING), prepared(), 6, scores=scores), 0.0)
    misread = np.array(item.exact)
    misread[:, 1, 2] = 50.0
    object.__setattr__(item, "exact", misread)
    messages = [message.columns.tolist() for message in sequences(item)]
    assert messages[0][1] == 2
    assert messages[1] == [0, 0, 0]
