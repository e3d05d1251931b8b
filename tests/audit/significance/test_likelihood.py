"""A log e-value has mean one over the keys, whatever the recording; waveforms are drawn from the real key stream."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mtm_audit.detectors.matched.plants import plant_family
from mtm_audit.detectors.matched.projections import Places, project
from mtm_audit.significance import likelihood
from mtm_audit.significance.channel_terms import SHAPES
from mtm_audit.significance.gains import all_levels, orientations
from mtm_audit.significance.likelihood import Hypotheses, approximate_log_e, log_e, log_e_of, weights
from mtm_audit.significance.normaliser import log_mean_normal, log_mean_sphere
from tests.audit.moving_robot import scheme_of
from tests.audit.significance.laws import assert_mean_is_one, assert_spread_is_the_law_s, most_passing
from tests.audit.significance.recorded import ONSET_S, prepared, tones_of, without_motion

LAWS = ("ensemble", "window")
KEYS = 250
TURNS = orientations(2, 2)
TONES_HZ = np.arange(1, 11) * 0.5
TIMINGS_S = np.array([ONSET_S, 1.3])


def scheme(power):
    return scheme_of(symbols=(1,), ticks=100, alphabet=16, power=power)


def projected(ready):
    """Two groups: one of two windows played alike, one alone."""
    starts_s = TIMINGS_S[:, None] + 2.0 * np.arange(3)
    return project(ready, Places(starts_s, np.array([0, 0, 1]), SHAPES, 2.0, TONES_HZ))


@cache
def projections():
    return projected(prepared())


def hypotheses(count, seed):
    rng = np.random.default_rng(seed)
    sizes = (len(TIMINGS_S), len(SHAPES.taps), len(all_levels().magnitudes), len(TURNS))
    return Hypotheses(*(rng.integers(0, size, count) for size in sizes))


@cache
def waveforms(power):
    """(keys * M, axes, 2 K) from the real key stream."""
    return np.concatenate([tones_of(scheme(power), number) for number in range(KEYS)])


def both_groups(tones):
    return np.stack([tones, tones])


@cache
def values(power):
    """Log e-values (hypotheses, groups, waveforms), and the exact variance (hypotheses, groups) of each e-value."""
    chosen = hypotheses(80, seed=8)
    found = log_e(projections(), both_groups(waveforms(power)), all_levels(), TURNS, chosen, power)
    linear, quadratic = weights(projections(), all_levels(), TURNS, chosen)
    log_mean = log_mean_normal if power == "ensemble" else log_mean_sphere
    second = (log_mean(2.0 * linear, 2.0 * quadratic) - 2.0 * log_mean(linear, quadratic)).sum(axis=-1)
    return found, np.expm1(second)


@pytest.mark.parametrize("power", LAWS)
def test_the_mean_over_keys_is_one(power):
    found, variance = values(power)
    assert_mean_is_one(found, variance)


@pytest.mark.parametrize("power", LAWS)
def test_the_spread_over_keys_is_what_the_law_says(power):
    found, variance = values(power)
    assert_spread_is_the_law_s(found, variance)


@pytest.mark.parametrize("power", LAWS)
@pytest.mark.parametrize("share", [0.1, 0.01, 0.001])
def test_large_values_are_as_rare_as_markov_says(power, share):
    found, _ = values(power)
    passed = (found >= -np.log(share)).sum(axis=-1)
    most = most_passing(found, share)
    assert np.all(passed <= most)
    mixed = np.logaddexp.reduce(found, axis=0) - np.log(len(found))
    assert np.all((mixed >= -np.log(share)).sum(axis=-1) <= most)


def test_each_power_law_has_its_own_normaliser():
    chosen = hypotheses(80, seed=8)
    linear, quadratic = weights(projections(), all_levels(), TURNS, chosen)
    apart = (log_mean_normal(linear, quadratic) - log_mean_sphere(linear, quadratic)).sum(axis=-1)
    tones = both_groups(waveforms("window")[:5])
    window, ensemble = (log_e(projections(), tones, all_levels(), TURNS, chosen, power) for power in LAWS[::-1])
    assert np.abs(apart).max() > 1.0
    assert window - ensemble == pytest.approx(np.repeat(apart[..., None], 5, axis=-1))


@pytest.mark.parametrize("power", LAWS)
def test_a_recording_that_nobody_saw_says_nothing(power):
    unseen = projected(without_motion(prepared(), seen=False))
    found = log_e(unseen, both_groups(waveforms(power)[:8]), all_levels(), TURNS, hypotheses(400, seed=9), power)
    assert found == pytest.approx(np.zeros_like(found), abs=1e-9)


@pytest.mark.parametrize("power", LAWS)
def test_zero_motion_speaks_against_a_message_in_numbers(power):
    """A loud waveform would have been seen: its e-value is below one on average, and always a number."""
    still = projected(without_motion(prepared()))
    found = log_e(still, both_groups(waveforms(power)[:200]), all_levels(), TURNS, hypotheses(400, seed=9), power)
    assert np.all(np.isfinite(found))
    assert found.mean() <= 0.0
    assert found.mean(axis=-1).max() <= 0.05


@pytest.mark.parametrize("power", LAWS)
def test_windows_played_alike_are_one_waveform(power):
    """The joint value of windows is that of their summed weights, not the sum of their values."""
    ready = prepared()
    starts_s = np.array([[ONSET_S, ONSET_S + 2.0]])
    apart = project(ready, Places(starts_s, np.array([0, 1]), SHAPES, 2.0, TONES_HZ))
    alike = project(ready, Places(starts_s, np.array([0, 0]), SHAPES, 2.0, TONES_HZ))
    chosen = Hypotheses(*(np.zeros(4, int), np.arange(4), np.array([2, 5, 8, 20]), np.array([0, 7, 20, 31])))
    tones = waveforms(power)[:12]
    linear, quadratic = weights(apart, all_levels(), TURNS, chosen)
    joint = log_e_of(linear.sum(axis=1, keepdims=True), quadratic.sum(axis=1, keepdims=True), tones[None], power)
    found = log_e(alike, tones[None], all_levels(), TURNS, chosen, power)
    assert found == pytest.approx(joint)
    separate = log_e(apart, both_groups(tones), all_levels(), TURNS, chosen, power).sum(axis=1, keepdims=True)
    assert np.max(np.abs(found - separate)) > 0.1


def test_the_approximation_is_exact_where_axes_are_seen_alike():
    """And the law is the normal one; it chooses the hypotheses that are then weighed exactly."""
    ready = prepared()
    weights = np.broadcast_to(ready.weights.mean(axis=0), ready.weights.shape)
    alike = projected(replace(ready, weights=weights, scales=np.ones(len(weights))))
    timings, plants = np.array([0, 1]), np.array([3, 5])
    tones = both_groups(waveforms("ensemble")[:6])
    table = approximate_log_e(alike, tones, all_levels(), TURNS, timings, plants, lambda groups: groups)
    pair, level, turn = (grid.ravel() for grid in np.meshgrid(*map(np.arange, table.shape[:3]), indexing="ij"))
    chosen = Hypotheses(timings[pair], plants[pair], level, turn)
    exact = log_e(alike, tones, all_levels(), TURNS, chosen, "ensemble")
    assert table.reshape(exact.shape) == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_the_approximation_adds_up_positions_part_by_part(monkeypatch):
    """A table of all windows is never held: windows of one position are added up a part of the pairs at a time."""
    terms = projected(prepared())
    tones, pairs = both_groups(waveforms("ensemble")[:6]), np.arange(5)
    asked = (terms, tones, all_levels(), TURNS, pairs % 2, pairs)
    groups = approximate_log_e(*asked, lambda table: table)
    monkeypatch.setattr(likelihood, "_MOST_TOGETHER", 2 * groups[0].size)
    sizes = []

    def both(table):
        sizes.append(len(table))
        return table.sum(axis=-2, keepdims=True)

    assert approximate_log_e(*asked, both) == pytest.approx(groups.sum(axis=-2, keepdims=True))
    assert sizes == [2, 2, 1]


@pytest.mark.parametrize("start_s", [-5.0, -1.0, 9.5, 40.0])
def test_windows_outside_the_recording_are_not_seen(start_s):
    places = Places(np.array([[start_s]]), np.array([0]), plant_family(np.array([0.0]), np.array([0.1])), 2.0, TONES_HZ)
    found = project(prepared(), places)
    if start_s in (-5.0, 40.0):
        assert np.all(found.seen == 0.0)
        assert np.all(found.linear == 0.0)
    else:
        assert 0.0 < found.seen.max() < found.cells
