"""What is believed of clocks and fleets before anything was seen, and that it counts."""

import numpy as np
import pytest

from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.fleet import _fleet_timing, _Near, _settled
from mtm_audit.detectors.matched.hypotheses import fold, log_clock_prior, log_rate_prior, make_grid
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.model.timing import Timing
from tests.audit.moving_robot import key_of, scheme_of

OWN, FLEET = Timing(0.0, 50.0), Timing(1.0, 50.0)


# A Cauchy law over relative rates with a scale of three in a thousand.
@pytest.mark.parametrize(
    ("error", "prior"), [(0.0, 1.0), (0.003, 1 / 2), (-0.003, 1 / 2), (0.009, 1 / 10), (0.03, 1 / 101)]
)
def test_clocks_are_believed_to_be_near_their_rate(error, prior):
    assert np.exp(log_rate_prior(np.array([50.0 * (1.0 + error)]), 50.0)) == pytest.approx([prior])


# Nine clocks of ten by a scale of a ten-thousandth, which makes them 270 times as dense at the nominal rate.
@pytest.mark.parametrize(
    ("error", "prior"),
    [
        (0.0, 1.0),
        (1e-4, (270 / 2 + 1) / 271),
        (0.003, (270 / 901 + 1 / 2) / 271),
        (0.03, (270 / 90_001 + 1 / 101) / 271),
    ],
)
def test_clocks_that_follow_utc_are_believed_to_be_quartz(error, prior):
    assert np.exp(log_clock_prior(np.array([50.0 * (1.0 + error)]), 50.0)) == pytest.approx([prior], rel=0.01)


def silent_motion(seconds=20.0, step_s=0.02):
    count = round(seconds / step_s)
    return Motion(0.0, step_s, np.zeros((2, count)), np.ones(count, dtype=bool))


@pytest.mark.parametrize("coarse_hz", [50.0, 49.75, 50.25])
def test_a_recording_that_says_nothing_leaves_the_usual_rate(coarse_hz):
    grid = make_grid(silent_motion(), 50.0, coarse_hz, 0.01, 200, 0, 1, None)
    (found,) = fold(np.zeros((1, 1, 1000)), grid, 3)
    nearest = np.abs(grid.rates_hz / 50.0 - 1.0).min()
    assert {abs(grid.rates_hz[one.rate] / 50.0 - 1.0) for one in found} == {nearest}
    assert [one.evidence for one in found] == pytest.approx([-np.log1p((nearest / 0.003) ** 2)] * len(found))


def near(rate_hz):
    return _Near(np.array([rate_hz]), np.array([0.0]), rate_hz)


@pytest.mark.parametrize(("lead", "rate_hz"), [(0.0, 50.0), (2.25, 50.0), (2.35, 50.45)])
def test_a_fleet_s_rate_has_to_outweigh_the_usual_one(lead, rate_hz):
    # A clock nine in a thousand fast is ten times rarer, 2.3 nats.
    codebook = key_of(scheme_of()).codebook()
    usual, fast = np.array([[1.0]]), np.array([[1.0 + lead / 2.0]])
    offered, weighed = [near(50.0), near(50.45)], [np.concatenate([usual, fast])] * 2
    shared, best = _fleet_timing(codebook, offered, weighed)
    assert [found.timing.rate_hz for found in shared] == [rate_hz] * 2
    expected = 1.0 if rate_hz == 50.0 else 1.0 + lead / 2.0 - np.log(10.0)
    assert [found.evidence for found in shared] == pytest.approx([expected] * 2)
    assert best == pytest.approx([max(1.0, 1.0 + lead / 2.0 - np.log(10.0))] * 2)


def takes_fleet_s(lost, *others):
    """Whether a robot takes the fleet's timing, which costs it `lost` nats; `others` gain so many by it."""
    own = [Found(OWN, 10.0)] * (1 + len(others))
    shared = [Found(FLEET, 10.0 - lost), *(Found(FLEET, 10.0 + gain) for gain in others)]
    return _settled(own, shared)[0].timing == FLEET


@pytest.mark.parametrize(
    ("others", "most"),
    [
        # Nobody else shows anything: even odds that there is one timing, log(1 + 500 / 501).
        ((), 0.692),
        # Two that agree: it is one of one and not of 500, log(501).
        ((20.0, 20.0), 6.217),
        # Two that disagree: what it found by itself is as good as theirs.
        ((-40.0, -40.0), 0.0),
        # One that is as well off with it: log(1 + 500 / 2).
        ((0.0,), 5.525),
    ],
)
def test_a_robot_gives_up_so_much_for_its_fleet_s_timing(others, most):
    assert takes_fleet_s(most - 0.01, *others)
    assert not takes_fleet_s(most + 0.01, *others)


def test_a_fleet_s_timing_that_is_better_is_always_taken():
    assert takes_fleet_s(-1.0, -40.0, -40.0)
