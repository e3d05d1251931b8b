import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.planning.correction import at_most, coded, overhead_table, two_digits
from mtm_audit.planning.plan import Problem
from mtm_audit.planning.search import search
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable
from tests.audit.planning.paper import paper_table


def test_the_overhead_table_is_the_paper_s():
    assert [
        (code.errors, code.length, code.data, *(two_digits(factors[M]) for M in (8, 4, 2)))
        for code, factors in overhead_table()
    ] == [(1, 7, 5, "1.4", "2.8", "4.2"), (2, 7, 3, "2.3", "4.7", "7.0"), (3, 7, 1, "7.0", "14", "21")]


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6), st.integers(0, 6))
def test_at_most_counts_every_way_to_err(rights, errors):
    expected = 0.0
    for wrong in itertools.product((False, True), repeat=len(rights)):
        if sum(wrong) <= errors:
            chance = 1.0
            for right, is_wrong in zip(rights, wrong, strict=True):
                chance *= 1.0 - right if is_wrong else right
            expected += chance
    assert at_most(errors, rights) == pytest.approx(expected)


def plan_of(alphabet, accuracy, bits):
    table = AccuracyTable((AccuracyPoint("x", alphabet, 100, round(1000 * accuracy), 1000),))
    return search(table, Problem(bits, 0.01))[0].plan


def test_a_code_on_one_channel_corrects_one_of_seven():
    found = coded(plan_of(8, 0.9, 15), 15, 1)
    assert (found.code.length, found.code.data, found.code.field_bits) == (7, 5, 3)
    assert found.message_ticks == 700
    assert found.accuracy == pytest.approx(0.9**7 + 7 * 0.1 * 0.9**6)


def test_short_alphabets_group_symbols_into_the_smallest_field():
    found = coded(plan_of(4, 0.9, 10), 10, 1)
    # GF(4) has codewords of three; in GF(16) ten bits are three symbols of two.
    assert (found.code.length, found.code.data, found.code.field_bits) == (5, 3, 4)
    assert found.message_ticks == 1000
    assert found.accuracy == pytest.approx(at_most(1, [0.81] * 5))


def test_an_alphabet_that_is_no_power_of_two_has_no_code():
    assert coded(plan_of(6, 0.9, 10), 10, 1) is None


def test_codewords_are_dealt_as_the_plan_deals_symbols():
    plan = search(paper_table("lander"), Problem(10, 0.9, (4,), measured_only=True))[2].plan
    found = coded(plan, 10, 1)
    # Two and three of five field symbols, each of two channel symbols: twice as many as uncoded.
    assert found.message_ticks == 2 * 576
    x, y = (curve.accuracy(plan.message_ticks // count) ** 2 for curve, count in plan.parts)
    assert found.accuracy == pytest.approx(at_most(1, [x, x, y, y, y]))
