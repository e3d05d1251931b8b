import numpy as np
import pytest

from mtm_audit.survey.colours import find_colours
from mtm_audit.tracking.colour import ColourTracker
from tests.audit.small_films import BLUE, CYAN, RED, frames, marker, patch, texture

PURPLE = (190, 40, 150)


def pictures(*things, seconds=0.5, **how):
    return list(frames(list(things), seconds=seconds, **how))[::3]


def test_colours_are_named_as_the_option_takes_them():
    things = [(patch(RED), (80, 80), True), (patch(CYAN), (200, 80), True)]
    found = find_colours(pictures(*things))
    assert {colour.name for colour in found} == {"#dc2828", "#1edcdc"}
    assert {round(colour.hue_deg) for colour in found} == {0, 180}
    tracks = ColourTracker(tuple(colour.name for colour in found)).track(frames(things, seconds=0.5))
    assert [track.valid.all() for track in tracks] == [True, True]


def test_a_patch_is_where_it_is():
    (found,) = find_colours(pictures((patch(BLUE), (200, 100), False)))
    assert found.boxes[0] == pytest.approx((185, 85, 215, 115), abs=1)
    assert (found.moves, found.patches, found.is_background) == (False, 1, False)


def test_what_moves_comes_first_and_patches_are_counted():
    still = [(patch(BLUE, 60), (250, 60), False), (patch(BLUE, 50), (250, 180), False)]
    moving, resting = find_colours(pictures((patch(RED, 20), (80, 80), True), *still, seconds=1.0))
    assert (moving.name, moving.moves) == ("#dc2828", True)
    assert (resting.moves, resting.patches) == (False, 2)


def test_near_hues_are_one_colour_and_far_ones_two():
    similar = [(patch((200, 60, 30)), (80, 80), False), (patch((200, 80, 30)), (200, 80), False)]
    assert len(find_colours(pictures(*similar))) == 1
    assert len(find_colours(pictures((patch(BLUE), (80, 80), False), (patch(PURPLE), (200, 80), False)))) == 2


def test_a_coloured_floor_is_no_patch():
    floor = np.full((240, 320, 3), (40, 160, 40), np.uint8)
    (green,) = find_colours([type(one)(one.time_s, floor) for one in pictures()])
    assert green.is_background
    assert green.share == 1.0


def test_gray_films_show_no_colour():
    assert find_colours(pictures((marker(), (80, 80), True), floor=texture())) == ()


def test_a_speck_is_no_colour():
    assert find_colours(pictures((patch(RED, 3), (80, 80), True))) == ()
