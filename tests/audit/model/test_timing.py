import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.detectors.gcc_phat import RATE_SCALES, find_onset, plan_onset_search
from mtm_audit.model.glimpse import glimpse_of_track, tick_velocities
from mtm_audit.model.track import Track
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=600))
CHANNEL = KEY.scheme.channels[0]
BAND = np.array(KEY.scheme.band_hz) / KEY.scheme.rate_hz
PLANT_DELAY_S = 0.3  # command delay, lag, and the tick that a command is held


def found(track, rates_hz, key=KEY):
    channel = key.scheme.channels[0]
    ticks = key.scheme.window_ticks(channel)
    plan = plan_onset_search(glimpse_of_track(track), rates_hz, BAND, ticks)
    return find_onset(plan, [key.codebook().samples(channel, 0)], channel.symbols, ticks)


def test_the_rates_are_the_paper_s():
    assert len(RATE_SCALES) == 101
    assert (RATE_SCALES[0], RATE_SCALES[50], RATE_SCALES[-1]) == pytest.approx((0.8, 1.0, 1.2))


@pytest.mark.parametrize("onset_s", [0.0, 1.37, 4.2])
def test_the_onset_is_found_within_the_plant_s_delay(onset_s):
    track = robot_track(KEY, "robot0", (3, 1), onset_s + 13.0, onset_s=onset_s)
    timing = found(track, np.array([50.0]))
    assert onset_s - 0.02 <= timing.onset_s <= onset_s + PLANT_DELAY_S
    assert timing.rate_hz == 50.0


@pytest.mark.parametrize("scale", [0.97, 1.03])
def test_a_clock_that_is_off_by_three_percent_is_found(scale):
    track = robot_track(KEY, "robot0", (3, 1), 16.0, onset_s=1.0, rate_scale=scale)
    timing = found(track, 50.0 * RATE_SCALES)
    assert timing.rate_hz == pytest.approx(50.0 * scale, rel=0.009)
    assert timing.onset_s == pytest.approx(1.0, abs=0.4)


def test_recordings_that_start_late_give_the_same_instant():
    track = robot_track(KEY, "robot0", (3, 1), 15.0, onset_s=1.0)
    moved = Track(track.name, track.times_s + 1e6, track.positions, track.valid)
    near, far = found(track, np.array([50.0])), found(moved, np.array([50.0]))
    assert far.onset_s - 1e6 == pytest.approx(near.onset_s, abs=0.021)


def test_a_short_recording_is_taken_to_start_with_the_message():
    track = robot_track(KEY, "robot0", (3, 1), 9.0)
    assert found(track, np.array([50.0])).onset_s == 0.0


@given(offset=st.integers(0, 300), symbol=st.integers(0, 3), gain=st.floats(0.01, 10.0))
def test_a_waveform_alone_is_found_on_the_very_tick(offset, symbol, gain):
    ticks = KEY.scheme.window_ticks(CHANNEL)
    waveform = KEY.codebook().samples(CHANNEL, 0)[symbol]
    velocities = np.zeros((1000, 2))
    velocities[offset : offset + 2 * ticks] = gain * np.concatenate([waveform, waveform], axis=1).T[: 1000 - offset]
    positions = np.concatenate([np.zeros((1, 2)), np.cumsum(velocities, axis=0) / 50.0])
    track = Track("robot0", np.arange(1001) / 50.0, positions, np.ones(1001, dtype=bool))
    timing = found(track, np.array([50.0]))
    assert timing.onset_s == pytest.approx(offset / 50.0)


@given(
    rate_hz=st.floats(20.0, 200.0), slope=st.floats(-3.0, 3.0), start_s=st.floats(-5.0, 5.0), seed=st.integers(0, 99)
)
def test_a_steady_motion_is_the_same_velocity_in_every_tick(rate_hz, slope, start_s, seed):
    times_s = start_s + np.sort(np.random.default_rng(seed).uniform(0.0, 3.0, 120))
    times_s = np.unique(np.concatenate([[start_s, start_s + 3.0], times_s]))
    track = Track("a", times_s, slope * times_s[:, None], np.ones(len(times_s), dtype=bool), axes=("x",))
    velocities = tick_velocities(glimpse_of_track(track), start_s, rate_hz, int(2.9 * rate_hz))
    assert velocities == pytest.approx(slope, abs=1e-6)
