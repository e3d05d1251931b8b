import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel, whitened
from mtm_audit.detectors.matched.plants import COARSE, TAIL_S
from mtm_audit.detectors.matched.windows import (
    _from_tones,
    _from_waveforms,
    make_window,
    make_windows,
    response_rows,
    statistics,
)
from mtm_audit.model.timing import Timing
from tests.audit.moving_robot import key_of, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=200, alphabet=8))
CHANNEL = KEY.scheme.channels[0]
STEP_S = 0.04


def motion_of(count, seed=0, axes=2):
    velocities = np.random.default_rng(seed).standard_normal((axes, count))
    return Motion(10.0, STEP_S, velocities, np.ones(count, dtype=bool))


def noise_of(motion, seed=0):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.0, 1.4, motion.velocities.shape)
    weights[:, :3] = 0.0
    scales = rng.uniform(0.5, 2.0, len(motion.velocities))
    return NoiseModel((np.array([[1.0, -0.7, 0.3, 0.1], [1.0, 0.2, -0.1, 0.0]]),), (scales,), (weights,))


def window_of(motion, number=0, onset_s=10.6, rate_hz=50.0):
    return make_window(KEY.codebook(), CHANNEL, motion, Timing(onset_s, rate_hz), 0, number, number % 2)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 3))
def test_both_ways_to_the_statistics_are_the_direct_sums(seed, axes, observed_axes):
    rng = np.random.default_rng(seed)
    tones, heard = rng.standard_normal((5, axes, 6)), rng.standard_normal((4, 6, 20))
    pulled, weights = rng.standard_normal((observed_axes, 20)), rng.uniform(0.0, 1.4, (observed_axes, 20))
    waveforms = np.einsum("lak,pkn->lpan", tones, heard)
    information = np.einsum("lpan,dn->dlpa", waveforms, pulled)
    precision = np.einsum("lpan,lpbn,dn->dlpab", waveforms, waveforms, weights)
    by_tones = _from_tones(tones.reshape(5 * axes, 6), axes, heard, pulled, weights)
    by_waveforms = _from_waveforms(waveforms.transpose(1, 0, 2, 3), pulled, weights)
    for found in (by_waveforms, by_tones):
        assert found.information == pytest.approx(information)
        assert found.precision == pytest.approx(precision)


@pytest.mark.parametrize("candidates", [1, 8], ids=["few", "many"])
def test_gains_are_those_of_weighted_least_squares(candidates):
    motion = motion_of(100)
    noise, window = noise_of(motion), window_of(motion)
    rows = response_rows(window, COARSE)
    found = statistics(window, window.tones.of(np.arange(candidates)), rows, noise, motion.velocities)
    plant, candidate, axis = 5, candidates - 1, 1
    padded = np.zeros((2, 100))
    padded[:, window.first : window.last] = window.tones.of(np.array([candidate]))[0] @ rows[plant]
    filters = noise.filters[0]
    template, observed = whitened(padded, filters[axis]), whitened(motion.velocities, filters)
    inside = slice(window.first - noise.order, window.last - noise.order)
    root = np.sqrt(noise.weights[0][axis, noise.order :])
    scale = noise.scales[0][axis]
    expected, *_ = np.linalg.lstsq((root * template)[:, inside].T, (root * observed[axis] / scale)[inside], rcond=None)
    gains = np.linalg.solve(found.precision[axis, candidate, plant], found.information[axis, candidate, plant])
    assert gains == pytest.approx(expected)


def test_the_planted_candidate_has_most_information():
    motion = motion_of(120)
    window = window_of(motion)
    rows = response_rows(window, COARSE)
    velocities = 1e-3 * motion.velocities
    mixing = np.array([[0.8, -0.6], [0.6, 0.8]])
    velocities[:, window.first : window.last] += mixing @ (window.tones.of(np.array([3]))[0] @ rows[4])
    noise = NoiseModel((np.array([[1.0, 0.0]] * 2),), (np.ones(2),), (np.ones((2, 120)),))
    found = statistics(window, window.tones.of(np.arange(len(window.tones))), rows, noise, velocities)
    gains = np.linalg.solve(found.precision[:, 3, 4], found.information[:, 3, 4][..., None])[..., 0]
    assert gains == pytest.approx(mixing, abs=0.01)


def test_tones_and_rows_make_the_waveform_at_a_perfect_plant():
    motion = motion_of(120)
    window = window_of(motion)
    turns = window.tones_hz[:, None] * window.since_start_s
    basis = np.concatenate([np.cos(2 * np.pi * turns), -np.sin(2 * np.pi * turns)])
    played = KEY.codebook().samples(CHANNEL, 0)[:, :, :50:2]
    # Cells of two ticks: the middle of a cell is a whole number of ticks after the start.
    at_ticks = (window.tones.of(np.arange(len(window.tones))) @ basis)[
        :, :, np.isclose(window.since_start_s * 50.0 % 2.0, 0.0)
    ]
    assert at_ticks[:, :, : played.shape[2]] == pytest.approx(played[:, :, : at_ticks.shape[2]])


def test_a_window_ends_with_its_tail_and_begins_with_its_start():
    window = window_of(motion_of(200), number=1)
    assert window.length_s == pytest.approx(2.0)
    assert window.since_start_s[0] == pytest.approx(0.0, abs=STEP_S)
    assert window.since_start_s[0] >= 0.0
    assert window.since_start_s[-1] == pytest.approx(2.0 + TAIL_S, abs=STEP_S)
    assert window.last - window.first == len(window.since_start_s)


def test_a_window_begun_before_the_recording_keeps_its_time():
    window = window_of(motion_of(200), number=0, onset_s=9.0)
    assert (window.first, window.since_start_s[0]) == (0, pytest.approx(1.0 + STEP_S / 2))


def test_a_fast_clock_s_window_is_short_and_its_tones_are_high():
    window = window_of(motion_of(200), rate_hz=55.0)
    plain = window_of(motion_of(200))
    assert window.length_s == pytest.approx(2.0 / 1.1)
    assert window.tones_hz == pytest.approx(1.1 * plain.tones_hz)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_windows_made_together_are_those_made_one_by_one(schedule):
    key = key_of(scheme_of(symbols=(2,), ticks=200, schedule=schedule))
    motion, timing, codebook = motion_of(200), Timing(10.6, 50.0), key.codebook()
    channel = key.scheme.channels[0]
    together = make_windows(codebook, channel, motion, timing, 3, range(-1, 3) if schedule == "fixed" else range(3))
    assert [window.group for window in together] == [window.number % 2 for window in together]
    for window in together:
        alone = make_window(codebook, channel, motion, timing, 3, window.number, window.group)
        assert (window.observation, window.first, window.last) == (3, alone.first, alone.last)
        every = np.arange(len(window.tones))
        assert np.array_equal(window.tones.of(every), alone.tones.of(every))
    assert (together[0].tones is together[1].tones) == (schedule == "fixed")
