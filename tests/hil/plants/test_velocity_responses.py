import numpy as np
import pytest

from hil.plants.velocity_responses import (
    delayed,
    lagged,
    notched,
    saturated,
    second_order,
    slew_limited,
    sticking,
    with_play,
)

STEP_S = 0.01
TIMES_S = np.arange(2000) * STEP_S
STEP = np.ones((2000, 2))


def tone(frequency_hz, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * frequency_hz * TIMES_S)[:, None] * np.ones(2)


def settled_gain(response, frequency_hz):
    return np.abs(response(tone(frequency_hz))[1000:]).max()


def test_a_delay_moves_the_demand_by_whole_steps():
    moved = delayed(STEP, STEP_S, 0.05)
    assert np.all(moved[:5] == 0.0)
    assert np.all(moved[5:] == 1.0)


def test_a_lag_has_made_up_all_but_1_e_after_its_time():
    assert lagged(STEP, STEP_S, 0.2)[19] == pytest.approx(1 - np.exp(-1))


def test_a_second_order_plant_overshoots_and_settles():
    followed = second_order(STEP, STEP_S, 1.0, 0.3)
    assert followed[-1] == pytest.approx(1.0, abs=1e-3)
    # exp(-pi zeta / sqrt(1 - zeta^2))
    assert followed.max() - 1.0 == pytest.approx(0.372, abs=0.01)


def test_a_notch_takes_its_frequency_out_and_no_other():
    assert settled_gain(lambda demand: notched(demand, STEP_S, 2.0, 1.0), 2.0) < 0.02
    assert settled_gain(lambda demand: notched(demand, STEP_S, 2.0, 1.0), 0.2) == pytest.approx(1.0, abs=0.02)


def test_a_saturated_gain_keeps_small_demands_and_its_limit():
    assert saturated(np.array([[0.001, 5.0]]), 0.3)[0] == pytest.approx([0.001, 0.3], rel=1e-4)


def test_friction_holds_a_vehicle_whose_demand_is_small():
    demand = np.array([[0.03, 0.03], [0.05, 0.05]])
    assert np.array_equal(sticking(demand, 0.06), [[0.0, 0.0], [0.05, 0.05]])


def test_a_slew_limit_bounds_the_acceleration():
    followed = slew_limited(STEP, STEP_S, 0.5)
    assert np.diff(followed, axis=0).max() <= 0.5 * STEP_S + 1e-12
    assert followed[150, 0] < 1.0 == followed[-1, 0]


def test_play_swallows_small_motion_and_lags_large_one():
    # Amplitudes of the path: 1 / (2 pi f).
    small, large = with_play(tone(2.0, 0.02), STEP_S, 0.01), with_play(tone(0.1, 1.0), STEP_S, 0.01)
    assert np.abs(small[200:]).max() < 1e-12
    path = np.cumsum(large, axis=0) * STEP_S
    assert path.max() == pytest.approx(np.cumsum(tone(0.1), axis=0).max() * STEP_S - 0.005, abs=1e-6)


@pytest.mark.parametrize("response", [
    lambda demand: delayed(demand, STEP_S, 0.1), lambda demand: lagged(demand, STEP_S, 0.1),
    lambda demand: second_order(demand, STEP_S, 1.0, 0.7), lambda demand: notched(demand, STEP_S, 2.0, 1.0),
    lambda demand: saturated(demand, 0.3), lambda demand: slew_limited(demand, STEP_S, 0.5),
    lambda demand: with_play(demand, STEP_S, 0.01), lambda demand: sticking(demand, 0.1),
])  # fmt: skip
def test_what_is_followed_depends_on_the_past_alone(response):
    demand = np.random.default_rng(1).standard_normal((400, 3))
    later = demand.copy()
    later[200:] += 1.0
    assert np.array_equal(response(demand)[:200], response(later)[:200])
    assert response(demand).shape == demand.shape
