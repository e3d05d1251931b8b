import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.live.timeline import Timeline


def test_the_first_thing_seen_is_at_zero_of_a_live_source():
    assert Timeline().time_s(1234.5, 99.0) == 0.0


def test_within_a_connection_stamps_count_and_not_arrivals():
    line = Timeline()
    times_s = [line.time_s(10.0 + 0.1 * k, 50.0 + 0.1 * k + 0.05 * (k % 3)) for k in range(5)]
    assert times_s == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


def test_a_gap_is_as_long_as_it_was_on_the_wall():
    line = Timeline()
    line.time_s(10.0, 50.0)
    line.begin_connection()
    assert line.time_s(3.0, 57.0) == pytest.approx(7.0)


def test_a_file_keeps_its_own_times():
    line = Timeline(is_live=False)
    assert [line.time_s(stamp_s, 0.0) for stamp_s in (2.0, 500.0)] == [2.0, 500.0]


def test_without_stamps_arrivals_count():
    line = Timeline()
    assert [line.time_s(None, arrival_s) for arrival_s in (5.0, 5.25)] == pytest.approx([0.0, 0.25])


@given(st.lists(st.tuples(st.floats(-1e5, 1e5), st.floats(0.0, 1e4)), max_size=30))
def test_times_always_rise(seen):
    line, arrivals = Timeline(), sorted(arrival for _, arrival in seen)
    times_s = [line.time_s(stamp, arrival) for (stamp, _), arrival in zip(seen, arrivals, strict=True)]
    known = [time_s for time_s in times_s if time_s is not None]
    assert known == sorted(set(known))
