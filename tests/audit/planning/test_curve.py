import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.experiments.runs.intervals import clopper_pearson
from mtm_audit.planning.curve import fit_curve
from mtm_audit.planning.interval import message_interval
from mtm_audit.planning.table import AccuracyPoint


def points_of(*counts, step=50, trials=100):
    return [AccuracyPoint("x", 4, step * place, right, trials) for place, right in enumerate(counts, 1)]


COUNTS = st.lists(st.tuples(st.integers(0, 40), st.integers(1, 40)), min_size=1, max_size=8)


@st.composite
def measured(draw):
    counts = draw(COUNTS)
    ticks = sorted(draw(st.sets(st.integers(1, 300), min_size=len(counts), max_size=len(counts))))
    return [AccuracyPoint("x", 4, t, min(pair), max(pair)) for t, pair in zip(ticks, counts, strict=True)]


def test_measured_points_alone_are_raw_and_nothing_lies_between():
    curve = fit_curve(points_of(50, 40, 90), measured_only=True)
    assert [curve.accuracy(ticks) for ticks in (50, 100, 150)] == [0.5, 0.4, 0.9]
    assert not curve.exists_at(75)
    assert np.isnan(curve.accuracy(75))


def test_falling_neighbours_are_pooled_by_their_trials():
    points = [
        AccuracyPoint("x", 4, 50, 60, 100),
        AccuracyPoint("x", 4, 100, 90, 300),
        AccuracyPoint("x", 4, 150, 9, 10),
    ]
    curve = fit_curve(points, measured_only=False)
    assert [curve.accuracy(ticks) for ticks in (50, 75, 100, 150)] == pytest.approx([0.375, 0.375, 0.375, 0.9])


def test_between_points_the_error_s_logarithm_is_interpolated():
    curve = fit_curve(points_of(60, 90), measured_only=False)
    assert curve.accuracy(75) == pytest.approx(1.0 - (0.4 * 0.1) ** 0.5)


def test_where_no_error_was_seen_half_an_error_counts():
    curve = fit_curve(points_of(60, 100, 100), measured_only=False)
    assert curve.accuracy(75) == pytest.approx(1.0 - (0.4 * 0.5 / 201.0) ** 0.5)
    assert [curve.accuracy(ticks) for ticks in (100, 125, 150)] == [1.0, 1.0, 1.0]


@given(measured(), st.booleans())
def test_a_curve_ends_with_the_measured_range(points, measured_only):
    curve = fit_curve(points, measured_only=measured_only)
    first, last = points[0].window_ticks, points[-1].window_ticks
    known = np.flatnonzero(np.isfinite(curve.accuracies))
    assert (known[0], known[-1]) == (first, last)
    assert [bool(curve.exists_at(ticks)) for ticks in range(last + 5)] == [ticks in known for ticks in range(last + 5)]


@given(measured())
def test_a_smoothed_curve_rises_from_zero_to_one(points):
    known = fit_curve(points, measured_only=False).accuracies
    known = known[np.isfinite(known)]
    assert np.all(np.diff(known) >= -1e-12)
    assert 0.0 <= known[0] <= known[-1] <= 1.0


@given(st.integers(0, 60), st.integers(1, 60), st.integers(1, 6))
def test_the_interval_of_one_measured_point_is_the_exact_one(one, other, symbols):
    right, trials = min(one, other), max(one, other)
    curve = fit_curve([AccuracyPoint("x", 4, 50, right, trials)], measured_only=True)
    expected = [end**symbols for end in clopper_pearson(right, trials)]
    assert message_interval([(curve, 50, symbols)]) == pytest.approx(expected, abs=2e-4)


@given(measured(), st.integers(1, 5), st.data())
def test_the_interval_holds_the_prediction(points, symbols, data):
    curve = fit_curve(points, measured_only=False)
    ticks = data.draw(st.integers(points[0].window_ticks, points[-1].window_ticks))
    low, high = message_interval([(curve, ticks, symbols)])
    assert low - 1e-9 <= curve.accuracy(ticks) ** symbols <= high + 1e-9


def test_an_interval_over_two_channels_covers_as_it_says():
    generator = np.random.default_rng(7)
    truths, covered = (0.93, 0.98), 0
    for _ in range(200):
        rights = [int(generator.binomial(150, truth)) for truth in truths]
        parts = [(fit_curve([AccuracyPoint("x", 4, 50, n, 150)], measured_only=True), 50, 2) for n in rights]
        low, high = message_interval(parts)
        covered += low <= (truths[0] * truths[1]) ** 2 <= high
    # At least 95 % is promised; fewer than 182 of 200 would have a probability below one in a hundred.
    assert covered >= 182
