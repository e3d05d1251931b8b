from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.experiments.detectors.bench_recording import Job, record
from hil.experiments.detectors.bench_rollout import learned_interference, read_genie
from hil.experiments.detectors.genie import (
    ORDER,
    Interference,
    fit_interference,
    log_likelihoods,
    responding_bins,
    tick_responses,
)
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.vehicles.motion_controller import MotionController
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.detectors.matched.motion import Motion
from mtm_onboard.protocol import Codebook

PLANT = calibrated_parameters()
SMOOTH = replace(PLANT, slip_mps=0.0, yaw_slip_radps=0.0, wheel_step_rpm=0.0)
WHITE = Interference(np.array([1.0, 0.0, 0.0]), np.array([1.0, 2.0]))


def still(cells):
    return Motion(0.0, 0.04, np.zeros((2, cells)), np.ones(cells, dtype=np.bool_))


def test_the_expected_motion_is_that_of_the_simulated_chassis():
    commands = Codebook(bytes(32), fleet_scheme(50)).samples(fleet_scheme(50).channels[0], 0)[0, 0] * 0.1
    controller = MotionController(MecanumPlant(SMOOTH, 0), deadman_s=None)
    controller.set_work_mode(True)
    positions_m = []
    for sample in range(201):
        controller.advance(sample * 0.01)
        positions_m.append(controller.plant.position_xy_m[0])
        tick, between = divmod(sample - 30, 2)
        if between == 0 and 0 <= tick <= len(commands):
            controller.command_speed(sample * 0.01, float(commands[tick]) if tick < len(commands) else 0.0, 0.0, 0.0)
    moved = np.diff(positions_m[::4]) / 0.04
    expected = tick_responses(SMOOTH, 0.3, 50.0, len(commands), still(50)) @ commands
    assert np.std(moved) > 0.01
    assert np.std(moved - expected) < 0.02 * np.std(moved)


def test_a_command_held_long_is_followed_whole():
    responses = tick_responses(PLANT, 0.0, 50.0, 200, still(100))
    assert responses[-1].sum() == pytest.approx(1.0, abs=1e-6)
    assert responses[0].sum() == 0.0


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 40), loudness=st.floats(1e-3, 1e3))
def test_under_tiny_noise_the_sent_symbol_is_most_likely(seed, count, loudness):
    generator = np.random.default_rng(seed)
    candidates = loudness * generator.standard_normal((count, 2, 30))
    sent = int(generator.integers(count))
    observed = candidates[sent] + 1e-6 * loudness * generator.standard_normal((2, 30))
    assert np.argmax(log_likelihoods(observed, candidates, WHITE)) == sent


def test_an_axis_that_is_noisier_says_less():
    observed = np.zeros((2, 20))
    off = np.zeros((3, 2, 20))
    off[1, 0], off[2, 1] = 1.0, 1.0
    nothing, on_quiet, on_noisy = log_likelihoods(observed, off, WHITE)
    assert nothing > on_noisy > on_quiet


def test_one_outlier_does_not_outweigh_all_other_samples():
    candidates = np.zeros((2, 2, 40))
    candidates[1, :, 5:] = 1.5
    observed = candidates[1].copy()
    observed[:, 30] = -30.0
    assert np.argmax(log_likelihoods(observed, candidates, WHITE)) == 1


def test_the_interference_that_was_put_in_is_found():
    generator = np.random.default_rng(0)
    silences = []
    for _ in range(6):
        kicks = generator.standard_normal((2, 1000)) * np.array([[0.1], [0.3]])
        signal = kicks.copy()
        for cell in range(1, 1000):
            signal[:, cell] += 0.7 * signal[:, cell - 1]
        silences.append(replace(still(1000), velocities=signal))
    found = fit_interference(silences)
    assert found.filter[:2] == pytest.approx([1.0, -0.7], abs=0.05)
    assert found.scales[1] / found.scales[0] == pytest.approx(3.0, rel=0.05)


def test_only_cells_that_hear_the_window_are_compared():
    bins = responding_bins(tick_responses(PLANT, 1.0, 50.0, 50, still(200)))
    assert bins.start == 26 - ORDER
    assert 50 + ORDER < bins.stop < 100


def test_on_a_chassis_that_hardly_slips_every_symbol_comes():
    job, calm = Job(64, 75, 3, 0.1), replace(PLANT, slip_mps=0.005, yaw_slip_radps=0.0)
    recording = record(job, calm, 11)
    assert np.array_equal(read_genie(job, calm, recording, learned_interference(job.end_s, calm, 3)), recording.symbols)
