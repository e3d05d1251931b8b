import numpy as np
import pytest

from mtm_audit.decoding.assignment import MOST_PAIRS, assign_tracks
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError
from tests.audit.moving_robot import scheme_of

FLEET = scheme_of(symbols=(1, 1, 1))


def tracks(*names):
    return [Track(name, np.arange(3.0), np.zeros((3, 2)), np.ones(3, dtype=bool)) for name in names]


def names_of(scheme, found, chosen=None):
    return {body: track.name for body, track in assign_tracks(scheme, found, chosen).settled.items()}


def test_equal_names_belong_together():
    found = names_of(FLEET, tracks("robot1", "robot0", "robot2"))
    assert found == {"robot0": "robot0", "robot1": "robot1", "robot2": "robot2"}


def test_equal_numbers_at_the_end_belong_together():
    found = names_of(FLEET, tracks("marker2", "marker0", "marker10"))
    assert found == {"robot0": "marker0", "robot2": "marker2"}


def test_a_choice_comes_before_names_and_numbers():
    found = names_of(FLEET, tracks("robot0", "marker2", "red"), {"robot0": "red"})
    assert found == {"robot0": "red", "robot2": "marker2"}


def test_a_number_that_two_tracks_bear_belongs_to_neither():
    assert names_of(FLEET, tracks("a1", "b1", "robot0")) == {"robot0": "robot0"}


def test_a_single_body_is_the_single_track_whatever_it_is_called():
    assert names_of(scheme_of(symbols=(1,)), tracks("something")) == {"robot0": "something"}


def test_what_nothing_settles_is_left_to_a_search():
    found = assign_tracks(FLEET, tracks("red", "robot1", "blue"))
    assert found.unsettled == ("robot0", "robot2")
    assert [track.name for track in found.free] == ["red", "blue"]


def test_a_recording_without_tracks_is_refused():
    with pytest.raises(MtmError, match="no track that could show robot0, robot1, robot2; record them"):
        assign_tracks(FLEET, [])


def test_more_pairs_than_can_be_searched_are_refused():
    strangers = tracks(*(f"shape {letter}" for letter in "abcdefghijklmnopqrstuvwxyz"))
    many = scheme_of(symbols=(1,) * (MOST_PAIRS // len(strangers) + 1))
    with pytest.raises(MtmError, match="8 bodies and 26 tracks .*, 208 pairs, .*--assign BODY=TRACK"):
        assign_tracks(many, strangers)
    assert assign_tracks(many, strangers, {"robot0": "shape a"}).unsettled == tuple(f"robot{n}" for n in range(1, 8))


def test_a_choice_of_what_does_not_exist_is_refused():
    with pytest.raises(MtmError, match="no track 'green'; it has: red"):
        assign_tracks(FLEET, tracks("red"), {"robot0": "green"})
    with pytest.raises(MtmError, match="no body 'arm'; its bodies are: robot0, robot1, robot2"):
        assign_tracks(FLEET, tracks("red"), {"arm": "red"})


def test_one_track_is_never_two_bodies():
    found = names_of(FLEET, tracks("robot0", "robot1"), {"robot0": "robot1"})
    assert found == {"robot0": "robot1"}
    with pytest.raises(MtmError, match="track 'robot1' is given to two bodies"):
        assign_tracks(FLEET, tracks("robot0", "robot1"), {"robot0": "robot1", "robot2": "robot1"})
