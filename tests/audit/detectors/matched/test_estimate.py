import numpy as np
import pytest

from mtm_audit.detectors.matched.evidence import log_sum_exp
from tests.audit.detectors.matched.fleet_motion import estimated, fleet_run, motions_of, turned, windows_of


def decisions(found):
    return tuple(int(np.argmax(ratios)) for ratios in found.ratios)


def posteriors(found):
    return np.array([np.exp(ratios - log_sum_exp(ratios, axis=0)) for ratios in found.ratios])


@pytest.mark.parametrize("seed", range(1, 5))
def test_four_robots_are_read_in_three_seconds_of_unknown_plant(seed):
    run = fleet_run(seed)
    found = estimated(run)
    assert decisions(found) == run.symbols
    assert posteriors(found).max(axis=1).min() > 0.99


@pytest.mark.parametrize("mirrored", [False, True], ids=["turned", "mirrored"])
def test_a_turned_or_mirrored_camera_changes_no_decision(mirrored):
    run = fleet_run(2)
    angle_rad = np.deg2rad(37.0)
    seen = estimated(run, [turned(track, angle_rad, mirrored=mirrored) for track in run.tracks])
    assert decisions(seen) == run.symbols
    assert posteriors(seen).max(axis=1).min() > 0.99


def test_robots_filmed_by_cameras_of_their_own_are_read_as_well():
    run = fleet_run(3)
    tracks = [turned(track, angle_rad) for track, angle_rad in zip(run.tracks, (0.0, 1.1, 2.9, 4.0), strict=True)]
    assert decisions(estimated(run, tracks)) == run.symbols


def test_the_unit_of_the_tracks_does_not_matter():
    run = fleet_run(2)
    pixels = [turned(track, 0.0) for track in run.tracks]
    for track in pixels:
        track.positions[:] *= 371.0
    assert np.array(estimated(run, pixels).ratios) == pytest.approx(np.array(estimated(run).ratios), rel=1e-6)


def test_silent_robots_leave_the_symbols_open():
    chances, sure = [], 0
    for seed in range(11, 17):
        found = estimated(fleet_run(seed, sends=False))
        chances += posteriors(found).max(axis=1).tolist()
        sure += sum(chance > 0.99 for chance in posteriors(found).max(axis=1))
        assert max(float(ratios.max()) for ratios in found.ratios) < 5.0
    assert np.mean(chances) < 0.75
    assert sure <= 1


def test_all_candidates_of_a_large_alphabet_have_finite_scores():
    run = fleet_run(4, alphabet=200)
    found = estimated(run)
    assert decisions(found) == run.symbols
    for ratios in found.ratios:
        assert ratios.shape == (200,)
        assert np.all(np.isfinite(ratios))
        assert np.ptp(np.sort(ratios)[:100]) > 0.0


def test_robots_with_the_same_symbols_are_read_each_by_itself():
    run = fleet_run(5, combine="same")
    assert decisions(estimated(run)) == run.symbols * 4


def test_several_symbols_on_a_channel_are_read_in_their_order():
    run = fleet_run(6, message_ticks=300, per_channel=2)
    assert decisions(estimated(run, count=2)) == run.symbols


def test_repeats_of_a_symbol_agree_and_are_surer_together():
    run = fleet_run(7, message_ticks=100, seconds=1.5 + 4.6)
    once, twice = estimated(run), estimated(run, count=2)
    symbols = np.repeat(run.symbols, 2)
    assert decisions(twice) == tuple(symbols)
    total = np.array(twice.ratios).reshape(4, 2, -1).sum(axis=1)
    margins = [np.sort(ratios)[-1] - np.sort(ratios)[-2] for ratios in (*once.ratios, *total)]
    assert np.mean(margins[4:]) > 1.5 * np.mean(margins[:4])


def test_expected_signals_and_residuals_add_up_to_the_motion():
    run = fleet_run(2)
    found, motions = estimated(run), motions_of(run)
    for motion, window, signal, residual in zip(
        motions, windows_of(run, motions), found.signals, found.residuals, strict=True
    ):
        whole = residual.copy()
        whole[:, window.first : window.last] += signal
        assert whole == pytest.approx(motion.velocities)
        assert np.mean(signal**2) > 1e-3


def test_one_robot_that_sends_is_told_apart_among_silent_ones():
    run, silent = fleet_run(8, message_ticks=300), fleet_run(8, message_ticks=300, sends=False)
    found = estimated(run, [run.tracks[0], *silent.tracks[1:]])
    best = [float(ratios.max()) for ratios in found.ratios]
    assert decisions(found)[0] == run.symbols[0]
    assert best[0] > 15.0
    assert max(best[1:]) < 5.0
