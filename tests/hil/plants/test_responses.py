import numpy as np
import pytest

from hil.plants.arm import Arm
from hil.plants.responses import (
    Backlash,
    Chain,
    Delay,
    Friction,
    Gain,
    PerAxis,
    Saturation,
    SlewLimit,
    lag,
    notch,
    oscillator,
)

STEP_S = 0.01
TIMES_S = np.arange(2000) * STEP_S
STEP = np.ones((2000, 2))


def tone(frequency_hz, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * frequency_hz * TIMES_S)[:, None] * np.ones(2)


def settled_gain(response, frequency_hz):
    return np.abs(response.advance(tone(frequency_hz))[1000:]).max()


def test_a_delay_moves_the_demand_by_whole_steps():
    moved = Delay(STEP_S, 0.05).advance(STEP)
    assert np.all(moved[:5] == 0.0)
    assert np.all(moved[5:] == 1.0)


def test_a_lag_has_made_up_all_but_1_e_after_its_time():
    assert lag(STEP_S, 0.2).advance(STEP)[19] == pytest.approx(1 - np.exp(-1))


def test_a_second_order_plant_overshoots_and_settles():
    followed = oscillator(STEP_S, 1.0, 0.3).advance(STEP)
    assert followed[-1] == pytest.approx(1.0, abs=1e-3)
    # exp(-pi zeta / sqrt(1 - zeta^2))
    assert followed.max() - 1.0 == pytest.approx(0.372, abs=0.01)


def test_a_notch_takes_its_frequency_out_and_no_other():
    assert settled_gain(notch(STEP_S, 2.0, 1.0), 2.0) < 0.02
    assert settled_gain(notch(STEP_S, 2.0, 1.0), 0.2) == pytest.approx(1.0, abs=0.02)


def test_a_saturated_gain_keeps_small_demands_and_its_limit():
    assert Saturation(0.3).advance(np.array([[0.001, 5.0]]))[0] == pytest.approx([0.001, 0.3], rel=1e-4)


def test_friction_holds_a_robot_whose_demand_is_small():
    demand = np.array([[0.03, 0.03], [0.05, 0.05]])
    assert np.array_equal(Friction(0.06).advance(demand), [[0.0, 0.0], [0.05, 0.05]])


def test_a_slew_limit_bounds_the_acceleration():
    followed = SlewLimit(STEP_S, 0.5).advance(STEP)
    assert np.diff(followed, axis=0).max() <= 0.5 * STEP_S + 1e-12
    assert followed[150, 0] < 1.0 == followed[-1, 0]


def test_play_swallows_small_motion_and_lags_large_one():
    # Amplitudes of the path: 1 / (2 pi f).
    small, large = (Backlash(STEP_S, 0.01).advance(tone(*of)) for of in ((2.0, 0.02), (0.1, 1.0)))
    assert np.abs(small[200:]).max() < 1e-12
    path = np.cumsum(large, axis=0) * STEP_S
    assert path.max() == pytest.approx(np.cumsum(tone(0.1), axis=0).max() * STEP_S - 0.005, abs=1e-6)


def test_an_arm_without_play_moves_its_tool_as_demanded():
    followed = Arm(STEP_S, 1e-6, 0.0).advance(np.column_stack([tone(0.5, 0.2), np.ones(2000)]))
    assert followed[:, :2] == pytest.approx(tone(0.5, 0.2), abs=2e-3)
    assert np.all(followed[:, 2] == 0.0)


def test_play_in_the_joints_swallows_small_moves_of_the_tool():
    quiet = np.column_stack([tone(2.0, 0.02), np.zeros(2000)])
    assert np.abs(Arm(STEP_S, 0.05, 0.04).advance(quiet)[200:]).max() < 1e-9


def test_axes_may_follow_each_in_its_own_way():
    followed = PerAxis([Gain(2.0), Delay(STEP_S, 0.02)]).advance(STEP)
    assert followed[:3].tolist() == [[2.0, 0.0], [2.0, 0.0], [2.0, 1.0]]


RESPONSES = [
    lambda: Delay(STEP_S, 0.1), lambda: lag(STEP_S, 0.1), lambda: oscillator(STEP_S, 1.0, 0.7),
    lambda: notch(STEP_S, 2.0, 1.0), lambda: Saturation(0.3), lambda: SlewLimit(STEP_S, 0.5),
    lambda: Backlash(STEP_S, 0.01), lambda: Friction(0.1), lambda: Arm(STEP_S, 0.1, 0.01), lambda: Gain(0.5),
    lambda: PerAxis([lag(STEP_S, 0.1), Backlash(STEP_S, 0.01), Delay(STEP_S, 0.03)]),
    lambda: Chain(Delay(STEP_S, 0.1), SlewLimit(STEP_S, 0.5), lag(STEP_S, 0.1)),
]  # fmt: skip


@pytest.mark.parametrize("make", RESPONSES)
def test_what_is_followed_depends_on_the_past_alone(make):
    demand = 0.2 * np.random.default_rng(1).standard_normal((400, 3))
    later = demand.copy()
    later[200:] += 0.1
    assert np.array_equal(make().advance(demand)[:200], make().advance(later)[:200])
    assert make().advance(demand).shape == demand.shape


@pytest.mark.parametrize("make", RESPONSES)
def test_a_run_in_parts_is_followed_as_the_whole(make):
    demand = 0.2 * np.random.default_rng(1).standard_normal((400, 3))
    response = make()
    parts = np.split(demand, [1, 2, 7, 150])
    assert np.concatenate([response.advance(part) for part in parts]) == pytest.approx(make().advance(demand), abs=1e-9)
