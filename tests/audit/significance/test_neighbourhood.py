"""Timings on a grid fixed before the key has a say: their priors add up to one at most, all of them together."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.significance.neighbourhood import Span, at_phase_of, centred, neighbourhood

RATE_HZ = 50.0
STEP_S = 0.04


def span_of(timing, seconds=21.0, ticks=150, order=1, *, backwards=True, begin_s=0.0):
    """The windows of which a recording from `begin_s` on shows a third at least."""
    length_s = ticks / timing.rate_hz
    first = math.ceil((begin_s - timing.onset_s) / length_s - 0.7)
    last = math.floor((begin_s + seconds - timing.onset_s) / length_s - 0.3)
    numbers = np.arange(first if backwards else max(0, first), last + 1)
    lasts_s = seconds
    return Span(numbers, ticks, STEP_S, begin_s, lasts_s, RATE_HZ, order)


def whole_grid(timings, onset, **recording):
    """Probability of every timing that the neighbourhoods of all `timings` hold, each counted once."""
    found = {}
    for timing in timings:
        span = span_of(timing, **recording)
        near = neighbourhood(span, timing, onset)
        # The same instants of the same windows are the same hypothesis, whichever search led to it.
        for starts_s, log_prior in zip(near.starts_s, near.log_priors, strict=True):
            ends = tuple(np.round(starts_s[[0, -1]], 6).tolist())
            found[(len(starts_s), ends)] = math.exp(log_prior)
    return found


def swept(low_s, high_s, rates, step_s=0.019):
    instants_s = np.arange(low_s, high_s, step_s)
    return [Timing(float(onset_s), RATE_HZ * rate) for rate in rates for onset_s in instants_s]


RATES = 1.0 + np.linspace(-0.012, 0.012, 25)


def test_a_known_onset_has_a_prior_of_sum_one_over_the_grid():
    grid = whole_grid(swept(1.2, 1.25, 1.0 + np.linspace(-0.1, 0.1, 401)), 1.2, backwards=False)
    total = sum(grid.values())
    assert total <= 1.0 + 1e-9
    # What is left is for clocks that are off by more than a tenth.
    assert total > 0.95


@pytest.mark.parametrize("ticks", [25, 50, 150, 600])
def test_an_unknown_onset_has_a_prior_of_sum_one_over_a_window(ticks):
    grid = whole_grid(swept(0.0, ticks / RATE_HZ, RATES, step_s=0.019 * ticks / 150), None, ticks=ticks)
    assert 0.3 < sum(grid.values()) <= 1.0


def test_rotations_of_a_repeated_message_share_the_prior():
    """With three positions the first window may carry any of them."""
    alone = whole_grid(swept(0.0, 3.0, RATES[::4]), None)
    shared = whole_grid(swept(0.0, 3.0, RATES[::4]), None, order=3)
    assert set(shared) == set(alone)
    assert 3.0 * sum(shared.values()) == pytest.approx(sum(alone.values()), rel=0.02)


def test_a_range_of_onsets_has_a_prior_of_sum_one():
    onset = OnsetRange(-3.0, 5.0)
    grid = whole_grid(swept(-3.0, 5.0, RATES[::4]), onset, backwards=False)
    assert 0.3 < sum(grid.values()) <= 1.0


@given(
    onset_s=st.floats(-20.0, 20.0),
    rate=st.floats(0.9, 1.1),
    ticks=st.integers(25, 900),
    order=st.integers(1, 8),
    known=st.sampled_from(["known", "range", "open"]),
)
def test_a_neighbourhood_holds_its_timing_and_part_of_the_grid(onset_s, rate, ticks, order, known):
    timing = Timing(onset_s, RATE_HZ * rate)
    span = span_of(timing, seconds=30.0, ticks=ticks, order=order)
    onset = {"known": onset_s, "range": OnsetRange(onset_s - 2.0, onset_s + 2.0), "open": None}[known]
    near = neighbourhood(span, timing, onset)
    assert near.starts_s.shape == (len(near.log_priors), len(span.numbers))
    assert np.all(np.isfinite(near.log_priors))
    assert np.logaddexp.reduce(near.log_priors) <= 0.0
    starts_s = timing.onset_s + span.numbers * ticks / timing.rate_hz
    # Within half a step of the grid at the pivot, and another at the recording's ends.
    if known != "known" or abs(span.numbers).max() <= len(span.numbers):
        assert np.abs(near.starts_s - starts_s).max(axis=1).min() <= 0.75 * STEP_S


def test_clocks_far_off_are_possible_and_rare():
    """Beside the nominal rate, which every neighbourhood holds, the rates near the found one."""
    priors = []
    for off in (0.0, 0.003, 0.03):
        timing = Timing(1.0, RATE_HZ * (1.0 + off))
        span = replace(span_of(Timing(1.0, RATE_HZ)), numbers=np.arange(7))
        near = neighbourhood(span, timing, 1.0)
        found_s = timing.onset_s + span.numbers * span.window_ticks / timing.rate_hz
        priors.append(near.log_priors[np.argmin(np.abs(near.starts_s - found_s).max(axis=1))])
    usual, slow, far = priors
    assert usual > slow > far > usual - math.log(300.0)


ONSETS = {
    "known": (1.2, swept(1.2, 1.21, 1.0 + np.linspace(-0.1, 0.1, 801))),
    "range": (OnsetRange(-3.0, 5.0), swept(-3.0, 5.4, RATES, step_s=0.009)),
    "open": (None, swept(0.0, 3.0, RATES, step_s=0.009)),
}


def weights_of(onset, timings):
    """The weight of each centre that is nearest to one of the timings."""
    found = {}
    for timing in timings:
        span = span_of(timing, backwards=onset is None)
        centre, log_weight = centred(span, timing, onset)
        pivot = 0 if isinstance(onset, float) else int(span.numbers[len(span.numbers) // 2])
        begins_s = centre.onset_s + pivot * span.window_ticks / centre.rate_hz
        found[(round(begins_s, 6), round(centre.rate_hz, 9))] = math.exp(log_weight)
    return found


@pytest.mark.parametrize(("onset", "timings"), ONSETS.values(), ids=ONSETS)
def test_whichever_centre_is_chosen_all_weigh_one_at_most(onset, timings):
    weights = weights_of(onset, timings)
    assert len(weights) > 20
    assert 0.3 < sum(weights.values()) <= 1.0 + 1e-9


@pytest.mark.parametrize(("onset", "timings"), ONSETS.values(), ids=ONSETS)
def test_a_timing_is_well_within_its_centre_s_neighbourhood(onset, timings):
    for timing in timings[:: max(1, len(timings) // 200)]:
        span = span_of(timing, backwards=onset is None)
        near = neighbourhood(span, centred(span, timing, onset)[0], onset)
        numbers = span.numbers - (0 if onset == 1.2 else span.numbers[len(span.numbers) // 2])
        # What the neighbourhood reaches beyond the timing, at the middle of the recording and at its end.
        begins_s = 1.2 if onset == 1.2 else timing.onset_s + (span.numbers[0] - numbers[0]) * 150 / timing.rate_hz
        away_s = near.starts_s - (begins_s + numbers * 150 / timing.rate_hz)
        middle = int(np.argmin(np.abs(numbers)))
        assert away_s[:, middle].min() <= -0.5 * STEP_S
        assert away_s[:, middle].max() >= 0.5 * STEP_S
        assert np.abs(away_s).max(axis=1).min() <= 0.75 * STEP_S


def test_a_known_onset_costs_less_than_an_open_one():
    timing = Timing(1.0, RATE_HZ)
    known, near, open_ = (centred(span_of(timing), timing, onset)[1] for onset in (1.0, OnsetRange(0.0, 2.0), None))
    assert known > near > open_


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(45.0, 55.0), st.integers(25, 900))
def test_another_s_phase_is_taken_at_the_nearest_window(own_s, other_s, rate_hz, ticks):
    moved = at_phase_of(Timing(own_s, RATE_HZ), Timing(other_s, rate_hz), ticks)
    length_s = ticks / rate_hz
    assert moved.rate_hz == rate_hz
    assert abs(moved.onset_s - own_s) <= 0.5 * length_s * (1.0 + 1e-9)
    windows = (moved.onset_s - other_s) / length_s
    assert windows == pytest.approx(round(windows), abs=1e-6)
