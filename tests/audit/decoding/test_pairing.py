from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.pairing import best_pairs, choose_pairs
from mtm_onboard.protocol import Channel

ONE_EACH = np.arange(2)


def test_the_best_choice_may_leave_out_the_strongest_pair():
    strengths = np.array([[[5.0, 4.0], [4.5, 0.0]]])
    chosen, sums = choose_pairs(strengths, ONE_EACH)
    assert chosen.tolist() == [[1, 0]]
    assert sums.tolist() == [8.5]


def test_each_codebook_chooses_for_itself():
    strengths = np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.0, 2.0], [2.0, 0.0]]])
    chosen, sums = choose_pairs(strengths, ONE_EACH)
    assert chosen.tolist() == [[0, 1], [1, 0]]
    assert sums.tolist() == [2.0, 4.0]


def test_a_weak_readable_pair_comes_before_a_strong_one_alone():
    strengths = np.array([[[9.0, -5.0], [-7.0, np.nan]]])
    chosen, sums = choose_pairs(strengths, ONE_EACH)
    assert chosen.tolist() == [[1, 0]]
    assert sums.tolist() == [-12.0]


def test_a_body_that_no_track_can_show_gets_none():
    chosen, sums = choose_pairs(np.array([[[1.0, 2.0], [np.nan, np.nan]]]), ONE_EACH)
    assert chosen.tolist() == [[1, -1]]
    assert sums.tolist() == [2.0]


def test_channels_of_one_body_go_to_one_track():
    strengths = np.array([[[3.0, 0.0], [0.0, 2.0], [1.0, 1.0]]])
    chosen, sums = choose_pairs(strengths, np.array([0, 0, 1]))
    assert chosen.tolist() == [[0, 1]]
    assert sums.tolist() == [4.0]


@given(st.integers(0, 10_000), st.integers(1, 3), st.integers(1, 4))
def test_no_other_choice_is_better(seed, bodies, tracks):
    strengths = np.random.default_rng(seed).normal(size=(2, bodies, tracks))
    chosen, sums = choose_pairs(strengths, np.arange(bodies))
    seats = [*range(tracks), *[-1] * max(0, bodies - tracks)]
    for number, table in enumerate(strengths):
        every = [
            sum(table[body, track] for body, track in enumerate(places) if track >= 0)
            for places in permutations(seats, bodies)
        ]
        assert sums[number] == pytest.approx(max(every))
        assert len(set(chosen[number][chosen[number] >= 0])) == min(bodies, tracks)


def channels(count):
    return [Channel(f"c{n}", f"b{n}", ("vx",), 1, 0.1) for n in range(count)]


def strengths_of(*rows):
    """Strengths (codebooks, channels, tracks) from those of each pair under all codebooks; None cannot be read."""
    count = len(next(pair for row in rows for pair in row if pair is not None))
    table = [[(np.nan,) * count if pair is None else pair for pair in row] for row in rows]
    return np.array(table, dtype=float).transpose(2, 0, 1)


def test_a_track_on_which_every_key_is_strong_draws_nobody():
    """Track 1 is strong for whatever key; track 0 is strong for this key alone."""
    found, sums = best_pairs(channels(1), strengths_of([(3.0, 1.0, 1.1, 0.9), (5.0, 5.1, 4.9, 5.0)]))
    assert found == {"b0": 0}
    assert sums[0] == pytest.approx(3.0)


def test_without_decoys_the_strongest_track_is_taken():
    found, sums = best_pairs(channels(2), strengths_of([(3.0,), (5.0,)], [(1.0,), (4.0,)]))
    assert found == {"b0": 0, "b1": 1}
    assert sums.tolist() == [7.0]


def test_what_all_read_on_the_chosen_pair_moves_no_comparison():
    _, plain = best_pairs(channels(1), strengths_of([(3.0, 1.0, 2.0), (1.0, 3.0, 1.0)]))
    _, raised = best_pairs(channels(1), strengths_of([(13.0, 11.0, 12.0), (1.0, 3.0, 1.0)]))
    assert np.diff(raised) == pytest.approx(np.diff(plain))


@pytest.mark.parametrize("codebooks", [1, 3])
def test_a_track_that_cannot_be_read_takes_no_other_along(codebooks):
    rows = [(1.0, 0.0, 0.0)[:codebooks], None], [(2.0, 0.0, 0.0)[:codebooks], None]
    found, sums = best_pairs(channels(2), strengths_of(*rows))
    assert found == {"b1": 0}
    assert sums[0] == 2.0


def test_bodies_without_a_readable_pair_get_nothing():
    found, sums = best_pairs(channels(2), np.full((3, 2, 2), np.nan))
    assert found == {}
    assert sums.tolist() == [0.0, 0.0, 0.0]


def test_channels_of_one_body_add_up_where_pairs_are_found():
    both = [Channel(f"c{n}", "b0", ("vx",), 1, 0.1) for n in range(2)]
    found, sums = best_pairs(both, strengths_of([(3.0,), (4.0,)], [(2.5,), (1.0,)]))
    assert found == {"b0": 0}
    assert sums.tolist() == [5.5]
