from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.refine import refined_timing
from mtm_audit.model.timing import Timing
from tests.audit.detectors.matched.fleet_motion import RATE_HZ, START_S, fleet_run, motions_of, windows_of

TICK_S = 1.0 / RATE_HZ
SECONDS = 24.0


def refined(run, timing, count, clock_hz=None):
    """The timings after as many refinements as it takes for nothing to change, three at the most."""
    motions = motions_of(run)
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    timings = [timing] * len(motions)
    for _ in range(3):
        windows = [
            window
            for number, own in enumerate(timings)
            for window in windows_of(run, motions, count, own)
            if window.observation == number
        ]
        found = estimate(windows, motions, noise)
        better = refined_timing(found, windows, motions, timings, clock_hz)
        if better == timings:
            break
        timings = better
    return timings


def drift_s(timing):
    """How much longer the message's ticks seem to take over the recording than they do."""
    return SECONDS * (RATE_HZ / timing.rate_hz - 1.0)


def assert_drift_is_small(timings):
    drifts_s = np.array([drift_s(timing) for timing in timings])
    assert np.sqrt(np.mean(drifts_s**2)) < 0.5 * TICK_S
    assert np.abs(drifts_s).max() < TICK_S


@pytest.mark.parametrize("error", [-0.003, 0.003])
def test_a_clock_three_in_a_thousand_off_is_put_right(error):
    run = fleet_run(21, message_ticks=200, seconds=START_S + SECONDS)
    middle_s = START_S + SECONDS / 2
    rate_hz = RATE_HZ * (1.0 + error)
    wrong = Timing(middle_s - SECONDS / 2 * RATE_HZ / rate_hz, rate_hz)
    assert abs(drift_s(wrong)) > 3.0 * TICK_S
    assert_drift_is_small(refined(run, wrong, count=6))


def test_a_clock_that_is_right_is_left_so():
    run = fleet_run(22, message_ticks=200, seconds=START_S + SECONDS)
    assert_drift_is_small(refined(run, Timing(START_S, RATE_HZ), count=6))


@pytest.mark.parametrize("seed", [22, 24])
def test_a_rate_that_a_clock_tells_is_not_moved_by_a_few_windows(seed):
    run = fleet_run(seed, message_ticks=200, seconds=START_S + SECONDS)
    for timing in refined(run, Timing(START_S, RATE_HZ), count=6, clock_hz=RATE_HZ):
        assert timing.rate_hz == pytest.approx(RATE_HZ, rel=1e-4)


def test_what_the_delays_disprove_a_clock_does_not_hold():
    run = fleet_run(21, message_ticks=200, seconds=START_S + SECONDS)
    rate_hz = RATE_HZ * 1.003
    middle_s = START_S + SECONDS / 2
    wrong = Timing(middle_s - SECONDS / 2 * RATE_HZ / rate_hz, rate_hz)
    assert_drift_is_small(refined(run, wrong, count=6, clock_hz=rate_hz))


def test_a_moment_of_a_message_says_nothing_about_the_clock():
    run = fleet_run(23, message_ticks=100)
    motions = motions_of(run)
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    windows = windows_of(run, motions)
    timings = [Timing(START_S, RATE_HZ)] * 4
    found = estimate(windows, motions, noise)
    assert refined_timing(found, windows, motions, timings) == timings
    silent = replace(found, signals=tuple(np.zeros_like(signal) for signal in found.signals))
    assert refined_timing(silent, windows, motions, timings) == timings
