import math

import pytest

from hil.experiments.worlds.points import HEADLINES, Point, headline_point, paper_entries, point_of

WORLDS = ("discovery", "lunar-lander", "reacher", "football")


@pytest.mark.parametrize("world", WORLDS)
def test_every_scheme_of_the_paper_s_tables_can_be_played(world):
    choices = 64 if world == "football" else 8
    for cell in paper_entries(world):
        point = cell.point
        assert point.scheme.message_ticks == point.message_ticks
        assert point.goal_ticks * point.goals == point.message_ticks * point.messages
        assert point.alphabet_size**point.goal_symbols >= choices


def test_the_paper_s_numbers_of_cells_are_all_there():
    assert [len(paper_entries(world)) for world in WORLDS] == [49, 55, 57, 42]


def test_a_cell_of_the_paper_is_as_printed():
    cell = next(
        cell
        for cell in paper_entries("lunar-lander")
        if cell.point
        == Point(world="lunar-lander", arrangement="main", alphabet_size=4, message_ticks=288, symbols="2", goals=8)
    )
    assert (cell.percent, cell.error, cell.margin) == (89.5, 1.6, 0.11)


def test_where_the_paper_gives_no_error_there_is_none():
    assert all(math.isnan(cell.error) for cell in paper_entries("football"))


@pytest.mark.parametrize("world", WORLDS)
def test_the_headline_and_its_shorter_messages_can_be_played(world):
    assert headline_point(world) in [cell.point for cell in paper_entries(world)]
    for ticks in HEADLINES[world].shorter_ticks:
        assert headline_point(world, ticks).scheme.message_ticks == ticks


def test_all_goals_of_a_rollout_may_share_one_message():
    point = next(cell.point for cell in paper_entries("reacher") if cell.point.message_ticks == 2112)
    assert (point.messages, point.goal_ticks, point.goal_symbols) == (1, 264, 3)


def test_a_point_survives_the_parameters_of_a_cell():
    point = headline_point("football")
    assert point_of({**point.parameters(), "batch": 3}) == point
