import pytest

from mtm_audit.planning.plan import Problem, symbols_needed
from mtm_audit.planning.report import fastest
from mtm_audit.planning.search import search
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable
from mtm_onboard.protocol import MtmError
from tests.audit.planning.paper import paper_table
from tests.audit.planning.random_problems import random_outcome

LANDER = paper_table("lander")
LANDER_JOB = Problem(10, 0.9, (4,), measured_only=True)
FOOTBALL = paper_table("football", agent0=("agent0", "agent1", "agent2"))


def split_of(table, problem):
    single, same, split = search(table, problem)
    assert (single.strategy, same.strategy, split.strategy) == ("single", "same", "split")
    return split.plan


def test_the_paper_s_lander_allocation_comes_from_its_tables():
    plan = split_of(LANDER, LANDER_JOB)
    assert (plan.allocation, plan.message_ticks) == ({"x": 2, "y": 3}, 576)
    assert plan.window_ticks == {"x": 288, "y": 192}
    assert round(plan.accuracy, 2) == 0.91
    assert plan.interval[0] < 0.90 < plan.interval[1]  # what the paper measured
    assert plan.is_measured
    assert plan.exact
    assert fastest(search(LANDER, LANDER_JOB)).strategy == "split"


def test_with_interpolation_the_lander_is_no_slower():
    plan = split_of(LANDER, Problem(10, 0.9, (4,)))
    assert plan.message_ticks <= 576
    assert plan.accuracy >= 0.9
    assert plan.allocation == {"x": 2, "y": 3}


@pytest.mark.parametrize("measured_only", [True, False])
def test_discovery_s_alike_axes_share_equally(measured_only):
    table = paper_table("discovery", x=("x", "y"))
    plan = split_of(table, Problem(3, 0.83, measured_only=measured_only))
    assert (plan.alphabet_size, plan.allocation) == (4, {"x": 1, "y": 1})
    # The paper measured 83.5 % at T = 60.
    assert plan.message_ticks <= 60


@pytest.mark.parametrize("measured_only", [True, False])
@pytest.mark.parametrize(("bits", "target", "alphabet"), [(6, 0.4, 4), (18, 0.9, 64), (36, 0.8, 64)])
def test_football_s_alike_agents_share_equally(bits, target, alphabet, measured_only):
    plan = split_of(FOOTBALL, Problem(bits, target, (alphabet,), measured_only))
    assert len(set(plan.allocation.values())) == 1
    assert len(plan.allocation) == 3


def test_same_message_uses_the_pooled_rows():
    _, same, _ = search(LANDER, Problem(3, 0.99, (8,), measured_only=True))
    assert (same.plan.allocation, same.plan.message_ticks) == ({"x+y": 1}, 288)


def test_the_search_is_over_alphabets_and_channels():
    single = search(LANDER, Problem(3, 0.9, measured_only=True))[0].plan
    # y at M = 8 has 93.3 % at T = 192, before any other row of either channel has 90.
    assert (single.alphabet_size, single.allocation, single.message_ticks) == (8, {"y": 1}, 192)


def test_of_equally_fast_schemes_the_more_accurate_is_taken():
    points = [AccuracyPoint(name, 4, 50, right, 100) for name, right in (("x", 95), ("y", 99))]
    assert search(AccuracyTable(tuple(points)), Problem(2, 0.9))[0].plan.allocation == {"y": 1}


def test_a_strategy_that_the_table_does_not_have_is_left_out():
    points = tuple(AccuracyPoint("x", 4, ticks, 99, 100) for ticks in (50, 100))
    single, same, split = search(AccuracyTable(points), Problem(4, 0.9))
    assert (single.plan.message_ticks, same.plan, split.plan) == (100, None, None)


def test_a_strategy_below_the_target_shows_its_best():
    table = AccuracyTable(
        (AccuracyPoint("x", 4, 50, 90, 100), AccuracyPoint("x", 4, 80, 95, 100), AccuracyPoint("x+y", 4, 50, 99, 100))
    )
    single, same, _ = search(table, Problem(4, 0.95))
    assert (single.meets_target, single.plan.message_ticks) == (False, 160)
    assert (same.meets_target, same.plan.message_ticks) == (True, 100)


def test_no_window_is_planned_outside_the_measured_range():
    for measured_only in (True, False):
        for one in search(LANDER, Problem(30, 0.5, measured_only=measured_only)):
            for curve, count in one.plan.parts:
                window = one.plan.message_ticks // count
                assert curve.window_ticks[0] <= window <= curve.window_ticks[-1]


def test_a_long_message_is_shared_out_by_capacity_and_says_so():
    split = split_of(LANDER, Problem(300, 0.5))
    assert not split.exact
    assert split.symbols >= symbols_needed(300, split.alphabet_size)
    assert split.accuracy >= 0.5


def test_what_cannot_be_is_refused_with_what_can():
    with pytest.raises(MtmError, match=r"the best has 0\.988 .*lower the target, shorten the payload, or measure"):
        search(LANDER, Problem(10, 0.9999, (4,), measured_only=True))
    with pytest.raises(MtmError, match="the table has no M = 16; choose of 2, 4, 8"):
        search(LANDER, Problem(10, 0.9, (4, 16)))
    with pytest.raises(MtmError, match="1 to 1024, so send a longer payload in several messages"):
        Problem(1025, 0.9)
    for target in (0.0, 1.0, 1.5, float("nan")):
        with pytest.raises(MtmError, match="choose one above 0 and below 1"):
            Problem(10, target)


@pytest.mark.parametrize(
    ("bits", "alphabet", "symbols"), [(10, 4, 5), (3, 4, 2), (3, 2, 3), (6, 64, 1), (5, 3, 4), (1, 8, 1)]
)
def test_a_message_has_as_few_symbols_as_hold_the_payload(bits, alphabet, symbols):
    assert symbols_needed(bits, alphabet) == symbols


@pytest.mark.parametrize("measured_only", [True, False])
def test_predictions_hold_on_held_out_messages(measured_only):
    outcomes = [random_outcome(seed, measured_only=measured_only) for seed in range(20)]
    assert sum(outcome.agrees for outcome in outcomes) >= 18
    assert sum(outcome.covers for outcome in outcomes) >= 17
    # An interval that says nothing would always agree.
    assert sorted(high - low for low, high in (outcome.plan.interval for outcome in outcomes))[10] < 0.15
