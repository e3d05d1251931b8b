import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.survey.timeline import timeline_of


def test_an_even_film_has_a_constant_rate():
    found = timeline_of(5.0 + np.arange(31) / 30.0)
    assert (found.count, found.begin_s, found.is_constant, found.gaps) == (31, 5.0, True, 0)
    assert found.rate_hz == pytest.approx(30.0)
    assert found.duration_s == pytest.approx(1.0)


def test_a_dropped_picture_is_a_gap_of_a_constant_rate():
    found = timeline_of(np.delete(np.arange(60) / 30.0, [10, 20, 21]))
    assert (found.is_constant, found.gaps, found.missing) == (True, 2, 3)
    assert found.longest_s == pytest.approx(0.1)


def test_a_phone_s_rate_is_variable():
    steps_s = np.tile([1 / 30, 1 / 24], 30)
    found = timeline_of(np.cumsum(steps_s))
    assert not found.is_constant
    assert 24.0 <= found.rate_hz <= 30.0


def test_times_in_whole_milliseconds_are_still_constant():
    assert timeline_of(np.round(np.arange(60) / 30.0, 3)).is_constant


def test_a_single_instant_has_no_rate():
    found = timeline_of(np.array([3.0]))
    assert (found.count, found.rate_hz, found.gaps, found.longest_s) == (1, None, 0, 0.0)


@given(st.lists(st.floats(1e-3, 10.0), min_size=1, max_size=40))
def test_what_is_told_of_any_times_is_finite(steps_s):
    found = timeline_of(np.cumsum(steps_s))
    assert found.count == len(steps_s)
    assert found.missing >= found.gaps
    assert np.isfinite([found.duration_s, found.longest_s]).all()
