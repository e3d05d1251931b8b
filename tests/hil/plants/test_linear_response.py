import numpy as np
import pytest

from hil.plants.linear_response import DELAYS_S, GAINS, LinearResponse, draw_response

STEP_S = 0.005


def measured_gain(response, frequency_hz):
    times_s = np.arange(0.0, 20.0, STEP_S)
    followed = response.followed(np.sin(2 * np.pi * frequency_hz * times_s), STEP_S)
    return np.sqrt(2.0) * np.std(followed[len(times_s) // 2 :])


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0])
def test_the_gain_at_a_frequency_is_that_of_the_motion(frequency_hz):
    response = LinearResponse(gain=0.8, delay_s=0.1, lag_s=0.2, natural_hz=2.0, damping=0.6)
    assert measured_gain(response, frequency_hz) == pytest.approx(abs(response.at([frequency_hz])[0]), rel=0.03)


def test_without_lag_and_oscillator_it_is_a_delay():
    demand = np.arange(10.0)
    followed = LinearResponse(gain=2.0, delay_s=2 * STEP_S).followed(demand, STEP_S)
    assert followed.tolist() == [0.0, 0.0, *(2.0 * demand[:-2])]


def test_responses_are_drawn_from_the_prior_and_repeat():
    drawn = [draw_response(np.random.default_rng(seed)) for seed in range(200)]
    assert all(DELAYS_S[0] <= item.delay_s <= DELAYS_S[1] and GAINS[0] <= item.gain <= GAINS[1] for item in drawn)
    assert max(item.delay_s for item in drawn) - min(item.delay_s for item in drawn) > 0.2
    assert draw_response(np.random.default_rng(3)) == drawn[3]
