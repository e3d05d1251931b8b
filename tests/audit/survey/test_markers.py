import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.survey.markers import find_markers
from tests.audit.small_films import frames, marker


def pictures(*things, count=3):
    return list(frames([(thing, middle, True) for thing, middle in things], seconds=count / 30.0))


@pytest.mark.parametrize("dictionary", ["4x4_50", "5x5_250", "6x6_250", "7x7_250", "apriltag_36h11", "aruco_original"])
def test_markers_of_any_dictionary_are_named(dictionary):
    found = find_markers(pictures((marker(dictionary, 3, 48), (80, 80)), (marker(dictionary, 7, 48), (200, 120))))
    assert found.dictionaries == (dictionary,)
    assert [(one.number, one.name) for one in found.markers] == [(3, "marker3"), (7, "marker7")]
    assert found.markers[0].side_px == pytest.approx(47.0, abs=1.5)
    assert not found.mirrored


def test_a_number_beyond_the_usual_size_needs_a_larger_one():
    found = find_markers(pictures((marker("4x4_1000", 120, 48), (80, 80)), (marker("4x4_50", 1, 48), (200, 120))))
    assert found.dictionaries == ("4x4_250",)
    assert [one.number for one in found.markers] == [1, 120]


def test_markers_of_two_dictionaries_are_both_named():
    found = find_markers(pictures((marker("4x4_50", 3), (80, 80)), (marker("apriltag_36h11", 5, 50), (200, 120))))
    assert set(found.dictionaries) == {"4x4_50", "apriltag_36h11"}


def test_a_mirrored_film_is_told_and_drawn_where_it_is():
    straight = pictures((marker("4x4_50", 0), (80, 80)), (marker("4x4_50", 1), (200, 80)))
    mirrored = [Frame(one.time_s, np.ascontiguousarray(one.image[:, ::-1])) for one in straight]
    plain, found = find_markers(straight), find_markers(mirrored)
    assert found.mirrored
    assert found.dictionaries == ("4x4_50",)
    for one, other in zip(plain.markers, found.markers, strict=True):
        assert other.corners[0].mean(axis=0)[0] == pytest.approx(319 - one.corners[0].mean(axis=0)[0], abs=0.5)


def test_what_is_read_in_one_of_several_pictures_is_chance():
    shown, empty = pictures((marker("4x4_50", 3), (80, 80)), count=1), pictures(count=2)
    assert find_markers([*shown, *empty]).markers == ()
    assert [one.number for one in find_markers(shown).markers] == [3]


def test_an_empty_film_shows_no_marker():
    assert find_markers(pictures()).markers == ()
