import itertools
import math

from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.live.looks import Looks, final_look
from tests.audit.moving_robot import scheme_of

SCHEME = scheme_of(symbols=(1, 1), ticks=600)


def every_look(seconds, step_s=0.01):
    looks, found = Looks(SCHEME), []
    for tick in range(int(seconds / step_s)):
        found += [look] if (look := looks.due(tick * step_s)) is not None else []
    return found


def test_the_first_look_comes_when_a_window_can_be_read():
    assert math.isclose(every_look(4.0)[0].until_s, 0.3 * 12.0)


def test_the_weights_of_all_looks_sum_to_one_at_most():
    spent = sum(1.0 / look.choices for look in every_look(600.0, 0.1))
    assert spent + 1.0 / final_look(0.0).choices <= 1.0
    assert 1.0 / final_look(0.0).choices + sum(1.0 / ((k + 1) * (k + 2)) for k in range(1, 100_000)) <= 1.0


def test_looks_come_within_a_second_in_the_first_ten():
    instants = [look.until_s for look in every_look(10.0)]
    assert all(after - before <= 1.0 for before, after in itertools.pairwise(instants))


def test_the_instants_of_looks_do_not_depend_on_when_it_is_asked():
    often = {look.number: look.until_s for look in every_look(60.0)}
    looks = Looks(SCHEME)
    for asked_s in (3.0, 21.0, 59.0):
        look = looks.due(asked_s)
        assert look is None or often[look.number] == look.until_s


@given(st.lists(st.floats(0.0, 5000.0), max_size=20))
def test_no_look_is_given_twice_or_early(asked):
    looks, numbers = Looks(SCHEME), []
    for now_s in sorted(asked):
        look = looks.due(now_s)
        if look is not None:
            assert look.until_s <= now_s < looks.next_s
            numbers.append(look.number)
    assert numbers == sorted(set(numbers))
