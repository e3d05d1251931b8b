"""How robots that carry the same symbols are pooled: the mean of their scores, or a vote that the mean decides."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mtm_audit.decoding import decode
from tests.audit.moving_robot import scheme_of

SCHEME = replace(scheme_of(symbols=(1, 1, 1), ticks=600), combine="same")


def pooled(pooling, *robots):
    """The symbols of several robots' scores (positions, M); None is a robot that was not read."""
    read = [
        SimpleNamespace(reading=None if scores is None else SimpleNamespace(scores=np.array(scores, dtype=float)))
        for scores in robots
    ]
    return decode._pooled(replace(SCHEME, pooling=pooling), read)


@pytest.mark.parametrize(
    ("robots", "mean", "majority"),
    [
        # Two weak votes against one strong one.
        (([[0.5, 0.6]], [[0.5, 0.6]], [[0.9, 0.1]]), [0], [1]),
        # However strong: the mean decides between as many votes, and nothing else.
        (([[0.0, 0.01]], [[0.0, 0.01]], [[1e6, 0.0]]), [0], [1]),
        # One vote each: the mean decides.
        (([[0.9, 0.2, 0.0]], [[0.1, 0.3, 0.0]]), [0], [0]),
        (([[0.3, 0.2, 0.0]], [[0.1, 0.9, 0.0]]), [1], [1]),
        # One vote each for 0, 1 and 2, of which 2 has the best mean; 3 has a better one and no vote.
        (([[9, 0, 0, 8]], [[0, 9, 0, 8]], [[0, 0, 12, 8]]), [3], [2]),
        # Each position by itself.
        (([[1, 0], [0, 1]], [[1, 0], [0, 1]], [[0, 9], [9, 0]]), [1, 0], [0, 1]),
        # A robot that was not read has no vote and no part in the mean.
        (([[0.2, 0.1]], None, [[0.2, 0.9]]), [1], [1]),
        (([[0.2, 0.1]], None, None), [0], [0]),
        # Scores that say nothing.
        (([[0.0, 0.0]], [[0.0, 0.0]]), [0], [0]),
    ],
)
def test_votes_and_means_choose_these_symbols(robots, mean, majority):
    assert pooled("mean", *robots) == mean
    assert pooled("majority", *robots) == majority


@pytest.mark.parametrize("offset", [-5.0, 0.0, 1e3])
def test_a_vote_is_the_same_wherever_scores_begin(offset):
    robots = [np.array([[0.3, 0.2, 0.0]]) + offset, np.array([[0.1, 0.9, 0.0]]) + offset]
    assert pooled("majority", *robots) == [1]
