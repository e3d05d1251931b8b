"""Channels of the arrangement "same" taken together: the paper's mean and majority, and posteriors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mtm_audit.decoding.pooling import pooled_posteriors, pooled_symbols

# Three channels, one position, three symbols. Two vote for 1 by little; the third is loud for 2.
LOUD_MINORITY = np.array([[[0.0, 1.0, 0.9]], [[0.0, 1.0, 0.9]], [[0.0, 0.0, 9.0]]])


@pytest.mark.parametrize(("pooling", "symbol"), [("mean", 2), ("majority", 1)])
def test_a_loud_minority_wins_the_mean_and_loses_the_vote(pooling, symbol):
    assert pooled_symbols(LOUD_MINORITY, pooling) == [symbol]


@pytest.mark.parametrize("pooling", ["mean", "majority"])
def test_channels_that_agree_are_followed_at_each_position(pooling):
    scores = np.tile(np.array([[0.1, 0.9, 0.0], [5.0, 1.0, 2.0], [-3.0, -2.0, -1.0]]), (4, 1, 1))
    assert pooled_symbols(scores, pooling) == [1, 0, 2]


@pytest.mark.parametrize("pooling", ["mean", "majority"])
def test_one_channel_alone_decides(pooling):
    assert pooled_symbols(np.array([[[1.0, 3.0, 2.0], [4.0, 3.0, 2.0]]]), pooling) == [1, 0]


def test_positions_are_voted_on_by_themselves():
    scores = np.concatenate([LOUD_MINORITY, LOUD_MINORITY[:, :, ::-1]], axis=1)
    assert pooled_symbols(scores, "majority") == [1, 1]
    assert pooled_symbols(scores, "mean") == [2, 0]


@pytest.mark.parametrize(
    ("scores", "symbol"),
    [
        # One vote each: the larger mean.
        ([[3.0, 0.0, 0.0], [0.0, 2.0, 0.0]], 0),
        ([[3.0, 0.0, 0.0], [0.0, 4.0, 0.0]], 1),
        # 0 and 1 have two votes each, and 2 the largest mean by far but one vote: it is no party to the tie.
        ([[2.0, 0.0, 1.9], [2.0, 0.0, 1.9], [0.0, 3.0, 2.9], [0.0, 3.0, 2.9], [0.0, 0.0, 50.0]], 1),
        # Scores far below zero are scores all the same.
        ([[-10.0, -20.0, -30.0], [-20.0, -11.0, -30.0]], 0),
    ],
)
def test_the_mean_breaks_a_tie_of_votes_among_those_tied(scores, symbol):
    assert pooled_symbols(np.array(scores)[:, None, :], "majority") == [symbol]


@pytest.mark.parametrize("pooling", ["mean", "majority"])
def test_scores_all_alike_give_a_symbol_and_no_nonsense(pooling):
    assert pooled_symbols(np.zeros((3, 2, 4)), pooling) == [0, 0]


SCORES = st.tuples(st.integers(1, 5), st.integers(1, 3), st.integers(2, 6)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.floats(-1e6, 1e6))
)


@given(SCORES)
def test_no_symbol_has_more_votes_than_the_majority_s(scores):
    ballots = np.argmax(scores, axis=2)
    for position, symbol in enumerate(pooled_symbols(scores, "majority")):
        votes = np.bincount(ballots[:, position], minlength=scores.shape[2])
        assert votes[symbol] == votes.max()


@given(SCORES)
def test_no_symbol_has_a_larger_mean_than_the_mean_s(scores):
    means = scores.mean(axis=0)
    for position, symbol in enumerate(pooled_symbols(scores, "mean")):
        assert means[position, symbol] == means[position].max()


@given(SCORES, st.randoms(use_true_random=False))
def test_the_order_of_the_channels_does_not_matter(scores, random):
    # Whole numbers: sums in another order are then the same, and so are ties.
    whole, order = np.round(scores), list(range(len(scores)))
    random.shuffle(order)
    for pooling in ("mean", "majority"):
        assert pooled_symbols(whole[order], pooling) == pooled_symbols(whole, pooling)


def test_independent_posteriors_multiply():
    one, other = np.array([[0.6, 0.3, 0.1]]), np.array([[0.2, 0.7, 0.1]])
    assert pooled_posteriors(np.stack([one, other])) == pytest.approx(np.array([[0.12, 0.21, 0.01]]) / 0.34)


def test_a_channel_that_knows_nothing_changes_nothing():
    known = np.array([[0.6, 0.3, 0.1], [0.05, 0.05, 0.9]])
    assert pooled_posteriors(np.stack([known, np.full((2, 3), 1.0 / 3.0)])) == pytest.approx(known)


def test_channels_sure_of_different_symbols_leave_a_number():
    pooled = pooled_posteriors(np.array([[[1.0, 0.0]], [[0.0, 1.0]]]))
    assert pooled == pytest.approx(np.array([[0.5, 0.5]]))
