import numpy as np
import pytest

from hil.experiments.identify.fit import fit_interference, fit_response, phase_delay_s
from hil.experiments.identify.logs import CommandLog, LoggedRun, logged_run
from hil.experiments.identify.profile import axis_response, profile_of
from hil.experiments.identify.spectra import RATE_HZ, cross_spectra
from hil.plants.linear_response import LinearResponse
from hil.plants.robots import STEP_S
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError
from tests.hil.experiments.identify.logged_robot import AHEAD, TURN, driven_logs


@pytest.fixture(scope="module")
def run():
    times_s, commands, poses = driven_logs(600.0)
    track = Track("a", times_s + STEP_S, poses[:, :2], np.ones(len(poses), bool), headings_rad=poses[:, 2])
    return logged_run(CommandLog(times_s, commands), track, RATE_HZ)


@pytest.mark.parametrize(("axis", "known"), [(0, AHEAD), (2, TURN)])
def test_response_and_interference_of_a_known_robot_are_found(run, axis, known):
    spectra = cross_spectra([run], axis)
    response, noise = fit_response(spectra), fit_interference(spectra)
    hz = np.array([0.5, 1.0, 2.0])
    assert np.abs(response.at(hz) / known.response.at(hz) - 1.0).max() < 0.12
    assert response.delay_s == pytest.approx(known.response.delay_s, abs=0.03)
    assert (response.natural_hz is None) == (known.response.natural_hz is None)
    assert noise.deviation == pytest.approx(known.deviation, rel=0.2)
    assert noise.correlation_s == pytest.approx(known.correlation_s, rel=0.4)
    assert noise.tracking < 0.003


def test_a_profile_s_axis_has_the_gain_and_all_of_the_motion(run):
    spectra = cross_spectra([run], 0)
    axis = axis_response("vx", [AHEAD.response, AHEAD.response], [spectra, spectra])
    hz = np.array([0.3, 0.7, 1.5, 3.0])
    gains, densities = axis.at(hz)
    assert axis.name == "vx"
    assert gains == pytest.approx(np.abs(AHEAD.response.at(hz)), rel=0.05)
    near = np.array([spectra.power_out[np.abs(spectra.frequencies_hz / own - 1.0) < 0.2].mean() for own in hz])
    assert densities == pytest.approx(near / np.sinc(hz / RATE_HZ) ** 2, rel=0.3)


def test_coherence_tells_what_the_command_explains(run):
    spectra = cross_spectra([run], 0)
    assert spectra.coherence.min() >= 0.0
    assert np.mean(spectra.coherence[5:20]) > 0.6
    assert np.mean(cross_spectra([scrambled(run)], 0).coherence[5:20]) < 0.1


def scrambled(run):
    return LoggedRun(run.step_s, np.random.default_rng(1).permutation(run.commanded), run.moved, run.seen)


def test_the_phase_shows_the_delay_with_the_lag(run):
    assert 0.2 < phase_delay_s(cross_spectra([run], 0)) < 0.36
    assert np.isnan(phase_delay_s(cross_spectra([scrambled(run)], 0)))


def test_pieces_with_gaps_are_left_out(run):
    seen = run.seen.copy()
    seen[3000:3200] = False
    moved = run.moved.copy()
    moved[~seen] = 1e6
    spectra = cross_spectra([LoggedRun(run.step_s, run.commanded, moved, seen)], 0)
    assert spectra.segments < cross_spectra([run], 0).segments
    assert spectra.unexplained_rms(0.5, 3.0) < 0.1


def test_a_short_run_gets_one_sentence(run):
    short = LoggedRun(run.step_s, run.commanded[:900], run.moved[:900], run.seen[:900])
    with pytest.raises(MtmError, match=r"in 6 pieces of 12\.8 s; it takes 8 of them"):
        cross_spectra([short], 0)


def test_a_profile_believes_in_the_plants_that_are_alike():
    plant = int(np.argmin((FINE.delays_s - 0.09) ** 2 + (FINE.lags_s - 0.2) ** 2 + np.isfinite(FINE.returns_s)))
    alike = LinearResponse(gain=0.4, delay_s=float(FINE.delays_s[plant]), lag_s=float(FINE.lags_s[plant]))
    profile = profile_of([alike])
    assert profile.weights.sum() == pytest.approx(1.0)
    assert int(np.argmax(profile.weights)) == plant


def test_no_profile_is_made_up_for_a_robot_like_none():
    assert profile_of([LinearResponse(delay_s=2.0)]) is None
