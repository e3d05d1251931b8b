from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.pairing import choose_pairs, search_pairs
from mtm_audit.detectors.base import ChannelReading, Observation, Reading
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Timing
from mtm_onboard.protocol import Channel, MtmError

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


def glimpses(*names):
    return [Glimpse(name, np.arange(3.0), np.zeros((2, 2)), np.ones(2, bool), ("x", "y")) for name in names]


def channels(count):
    return [Channel(f"c{n}", f"b{n}", ("vx",), 1, 0.1) for n in range(count)]


def reader(strengths, refuse_together=False):
    """Answers for channel c and the glimpse named n the strengths [c][n]; None cannot be read."""

    def read(observations):
        if refuse_together and len(observations) > 1:
            raise MtmError("too short")
        results = []
        for observation in observations:
            own = strengths[int(observation.channel.name[1:])][int(observation.glimpse.name)]
            scores = np.zeros((1, 2))
            results.append(
                MtmError("too short")
                if own is None
                else ChannelReading(
                    Reading(
                        Timing(0.0, 50.0), scores, scores, np.zeros(1, int), np.zeros(1, int), np.zeros(1), own[0], 1
                    ),
                    scores + 0.5,
                    scores,
                    np.array(own[1:], dtype=float),
                )
            )
        return results

    return read


def test_a_track_on_which_every_key_is_strong_draws_nobody():
    """Track 1 is strong for whatever key; track 0 is strong for this key alone."""
    pairing = search_pairs(channels(1), glimpses("0", "1"), reader([[(3.0, 1.0, 1.1, 0.9), (5.0, 5.1, 4.9, 5.0)]]))
    assert pairing.glimpses["b0"].name == "0"
    assert pairing.strengths[0] == pytest.approx(3.0)
    assert pairing.readings["c0"].reading.strength == 3.0


def test_what_all_read_on_the_chosen_pair_moves_no_comparison():
    plain = search_pairs(channels(1), glimpses("0", "1"), reader([[(3.0, 1.0, 2.0), (1.0, 3.0, 1.0)]]))
    raised = search_pairs(channels(1), glimpses("0", "1"), reader([[(13.0, 11.0, 12.0), (1.0, 3.0, 1.0)]]))
    assert np.diff(raised.strengths) == pytest.approx(np.diff(plain.strengths))


@pytest.mark.parametrize("refuse_together", [False, True])
def test_a_track_that_cannot_be_read_takes_no_other_along(refuse_together):
    table = [[(1.0, 0.0, 0.0), None], [(2.0, 0.0, 0.0), None]]
    pairing = search_pairs(channels(2), glimpses("0", "1"), reader(table, refuse_together))
    assert {body: glimpse.name for body, glimpse in pairing.glimpses.items()} == {"b1": "0"}
    assert list(pairing.readings) == ["c1"]


def test_no_pair_that_can_be_read_is_refused():
    with pytest.raises(MtmError, match="too short"):
        search_pairs(channels(1), glimpses("0"), reader([[None]]))


def test_progress_goes_channel_by_channel():
    told = []
    search_pairs(channels(2), glimpses("0"), reader([[(1.0, 0.0, 0.0)]] * 2), told.append)
    assert told == [0.0, 0.5]


def test_each_channel_is_read_against_every_track():
    asked = []
    read = reader([[(1.0, 0.0, 0.0)] * 2] * 2)

    def noted(observations):
        asked.append([(item.channel.name, item.glimpse.name) for item in observations])
        return read(observations)

    search_pairs(channels(2), glimpses("0", "1"), noted)
    assert asked == [[("c0", "0"), ("c0", "1")], [("c1", "0"), ("c1", "1")]]
    assert isinstance(read([Observation(channels(1)[0], glimpses("0")[0])])[0], ChannelReading)
