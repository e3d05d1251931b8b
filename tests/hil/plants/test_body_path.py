import numpy as np
import pytest

from hil.plants.body_path import gait, path_xy_m, slip

STEP_S = 0.01


def test_a_body_that_turns_once_while_it_drives_comes_back():
    turn = np.tile([0.5, 0.0, 2 * np.pi], (100, 1))
    path = path_xy_m(turn, STEP_S)
    assert path[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert path[49] == pytest.approx([0.0, 0.5 / np.pi], abs=1e-3)


def test_a_step_to_the_left_of_a_turned_body_goes_backwards():
    velocities = np.zeros((200, 3))
    velocities[:100, 2] = 0.5 * np.pi
    velocities[100:, 1] = 1.0
    assert path_xy_m(velocities, STEP_S)[-1] == pytest.approx([-1.0, 0.0], abs=1e-9)


def test_slip_is_stationary_as_asked():
    noise = slip((400, 2000), STEP_S, 0.04, 0.1, np.random.default_rng(2))
    assert noise[[0, -1]].std(axis=1) == pytest.approx([0.04, 0.04], rel=0.06)
    lag = 10
    assert np.mean(noise[:-lag] * noise[lag:]) / noise.var() == pytest.approx(np.exp(-1), abs=0.02)


def test_a_gait_has_its_power_at_the_stride_and_its_harmonics():
    sway = gait(6000, STEP_S, 1.5, 0.1, np.random.default_rng(3))
    spectrum = np.abs(np.fft.rfft(sway[:, 1])) ** 2
    frequencies_hz = np.fft.rfftfreq(6000, STEP_S)
    near = np.abs((frequencies_hz + 0.75) % 1.5 - 0.75) < 0.5
    assert spectrum[1:][near[1:]].sum() > 0.85 * spectrum[1:].sum()
    assert sway[:, 0].std() == pytest.approx(0.1 / np.sqrt(2), rel=0.15)
