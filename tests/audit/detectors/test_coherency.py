from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors import make_detector
from mtm_audit.detectors.base import Observation, Reading, combine_repeats, whole_windows
from mtm_audit.detectors.coherency import CoherencyDetector, rate_searched_scores
from mtm_audit.model.glimpse import Glimpse, glimpse_of_track
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Track
from mtm_audit.significance.decoys import decoy_codebooks
from mtm_onboard.protocol import MtmError
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=600))
CHANNEL = KEY.scheme.channels[0]


@pytest.fixture(scope="module")
def glimpse():
    return glimpse_of_track(robot_track(KEY, "robot0", (3, 1), 14.0, onset_s=1.0))


def read(key, glimpse, onset_s, decoys=0):
    codebooks = [key.codebook(), *decoy_codebooks(key, decoys)]
    return CoherencyDetector().read_channel(codebooks, key.scheme.channels[0], glimpse, onset_s)


def test_the_sent_symbols_score_best(glimpse):
    (reading,) = read(KEY, glimpse, 1.0)
    assert np.argmax(reading.scores, axis=1).tolist() == [3, 1]
    ranked = np.sort(reading.scores, axis=1)
    assert np.all(ranked[:, -1] - ranked[:, -2] > 0.05)


def test_a_decoy_s_symbols_score_like_any_that_was_not_sent(glimpse):
    key, *decoys = read(KEY, glimpse, 1.0, decoys=8)
    others = np.concatenate([decoy.scores.ravel() for decoy in decoys])
    quiet = np.sort(key.scores, axis=1)[:, :-1]
    assert abs(quiet.mean() - others.mean()) < 0.05
    assert key.strength > max(decoy.strength for decoy in decoys) + 0.1


def test_the_onset_is_found_with_the_symbols(glimpse):
    (reading,) = read(KEY, glimpse, None)
    assert np.argmax(reading.scores, axis=1).tolist() == [3, 1]
    assert reading.timing.onset_s == pytest.approx(1.0, abs=0.3)


def test_repeats_of_a_message_are_read_as_more_of_the_same(glimpse):
    key = key_of(scheme_of(symbols=(1,), ticks=200))
    track = robot_track(key, "robot0", (2,), 12.2)
    (reading,) = read(key, glimpse_of_track(track), 0.0)
    assert reading.window_positions.tolist() == [0, 0, 0]
    assert reading.scores == pytest.approx(reading.window_scores.mean(axis=0)[None, :])
    assert np.argmax(reading.scores) == 2


def test_a_rolling_schedule_plays_new_waveforms_in_every_window():
    key = key_of(scheme_of(symbols=(1,), ticks=300, schedule="rolling"))
    glimpse = glimpse_of_track(robot_track(key, "robot0", (1,), 12.2))
    (reading,) = read(key, glimpse, 0.0)
    assert np.argmax(reading.window_scores, axis=1).tolist() == [1, 1]


def test_posteriors_are_sure_of_what_was_sent_not_of_chance(glimpse):
    detector = CoherencyDetector()
    key, *decoys = read(KEY, glimpse, 1.0, decoys=10)
    sure = detector.posteriors(key, decoys)
    assert sure.sum(axis=1) == pytest.approx(1.0)
    assert sure[0, 3] > 0.99
    assert sure[1, 1] > 0.99
    chance = detector.posteriors(decoys[0], decoys[1:])
    assert chance.max() < 0.99


def scored(scores):
    """A reading of windows that each have a position of their own, with these scores."""
    scores = np.array(scores, dtype=float)
    numbers = np.arange(len(scores))
    return Reading(Timing(0.0, 50.0), scores, scores, numbers, numbers, numbers * 1.0, 0.0)


# Null scores of position 0: mean 0.2, variance 0.01; of position 1: mean 0.3, variance 0.04; of both: 0.25 and 0.0275.
NULL = [scored([[0.1, 0.3], [0.1, 0.5]]), scored([[0.1, 0.3], [0.5, 0.1]])]


def test_posteriors_are_those_of_a_gaussian_shift():
    # The best candidates lie 0.2 and 0.4 above their null mean: a shift of 0.3.
    posteriors = CoherencyDetector().posteriors(scored([[0.4, 0.2], [0.3, 0.7]]), NULL)
    first, second = 0.3 * 0.2 / 0.01, 0.3 * 0.4 / 0.04
    assert posteriors[0] == pytest.approx(np.array([np.exp(first), 1.0]) / (np.exp(first) + 1.0))
    assert posteriors[1] == pytest.approx(np.array([1.0, np.exp(second)]) / (np.exp(second) + 1.0))


def test_ratios_of_windows_are_those_of_the_same_law():
    ratios = CoherencyDetector().window_ratios(scored([[0.4, 0.2], [0.3, 0.7]]), NULL)
    # One mean and variance for all windows: the best lie 0.15 and 0.45 above, a shift of 0.3.
    assert ratios == pytest.approx(0.3 / 0.0275 * np.array([[0.15, -0.05], [0.05, 0.45]]))


def test_scores_below_chance_say_nothing():
    faint = scored([[0.1, 0.05], [0.1, 0.05]])
    assert CoherencyDetector().posteriors(faint, NULL) == pytest.approx(np.full((2, 2), 0.5))
    assert CoherencyDetector().window_ratios(faint, NULL) == pytest.approx(np.zeros((2, 2)))


def test_decoys_that_all_score_alike_divide_by_nothing():
    alike = [scored([[0.2, 0.2]]), scored([[0.2, 0.2]])]
    posteriors = CoherencyDetector().posteriors(scored([[0.4, 0.2]]), alike)
    assert posteriors == pytest.approx(np.array([[1.0, 0.0]]))
    assert np.isfinite(CoherencyDetector().window_ratios(scored([[0.4, 0.2]]), alike)).all()


def test_the_paper_s_score_of_a_single_window_is_the_reading_s(glimpse):
    (reading,) = read(KEY, glimpse, 1.0)
    alone = rate_searched_scores(KEY.codebook(), CHANNEL, glimpse, 1.0, window=1)
    assert alone == pytest.approx(reading.window_scores[1])


def test_a_recording_too_short_for_a_window_is_refused():
    track = robot_track(KEY, "robot0", (0, 0), 2.0)
    with pytest.raises(MtmError, match="no whole window of 6 s"):
        read(KEY, glimpse_of_track(track), 0.0)


def test_a_track_with_too_few_axes_is_refused():
    times_s = np.arange(900) / 50
    flat = Track("robot0", times_s, np.sin(times_s)[:, None], np.ones(900, dtype=bool), axes=("x",))
    with pytest.raises(MtmError, match="shows 1 axes but channel 'robot0' has 2"):
        read(KEY, glimpse_of_track(flat), 0.0)


def test_a_channel_s_axes_are_found_in_the_track_by_name(glimpse):
    sideways = Glimpse("robot0", glimpse.edges_s, glimpse.velocities[:, ::-1], glimpse.valid, ("y", "x"))
    turned = rate_searched_scores(KEY.codebook(), CHANNEL, sideways, 1.0)
    assert turned == pytest.approx(rate_searched_scores(KEY.codebook(), CHANNEL, glimpse, 1.0))


def test_axes_without_a_name_in_common_are_taken_in_order(glimpse):
    unnamed = replace(glimpse, axes=("first", "second"))
    taken = rate_searched_scores(KEY.codebook(), CHANNEL, unnamed, 1.0)
    assert taken == pytest.approx(rate_searched_scores(KEY.codebook(), CHANNEL, glimpse, 1.0))


def test_a_detector_that_does_not_exist_is_refused():
    with pytest.raises(MtmError, match="coherency"):
        make_detector("guessing")


def still(first_s, last_s):
    edges_s = np.array([first_s, last_s])
    return Glimpse("robot0", edges_s, np.zeros((1, 2)), np.ones(1, dtype=bool), ("x", "y"))


@pytest.mark.parametrize(
    ("onset_s", "backwards", "windows"),
    [
        (0.0, False, [0, 1, 2, 3, 4]),
        (3.0, False, [0, 1, 2]),
        (3.0, True, [-1, 0, 1, 2]),
        (-3.0, False, [2, 3, 4, 5]),
        (-4.0, True, [2, 3, 4, 5, 6]),
        (11.0, False, []),
    ],
)
def test_only_windows_inside_the_recording_count(onset_s, backwards, windows):
    timing = Timing(onset_s, 50.0)
    assert whole_windows(still(0.0, 10.0), timing, 100, backwards=backwards).tolist() == windows


def test_three_quarters_of_a_single_window_are_enough():
    assert whole_windows(still(0.0, 7.6), Timing(0.0, 50.0), 500, backwards=False).tolist() == [0]
    assert whole_windows(still(0.0, 7.4), Timing(0.0, 50.0), 500, backwards=False).tolist() == []


def test_positions_that_were_not_seen_have_no_scores():
    scores = combine_repeats(np.array([[1.0, 2.0], [3.0, 6.0]]), np.array([2, 2]), 3)
    assert scores.tolist() == [[0.0, 0.0], [0.0, 0.0], [2.0, 4.0]]


def test_a_reading_holds_where_its_windows_began(glimpse):
    (reading,) = read(KEY, glimpse, 1.0)
    assert isinstance(reading, Reading)
    assert reading.window_starts_s.tolist() == [1.0, 7.0]


def test_without_decoys_it_says_what_it_needs(glimpse):
    with pytest.raises(MtmError, match="decoys and got none; give one decoy at least"):
        CoherencyDetector().read(KEY.codebook(), [], [Observation(CHANNEL, glimpse)], 1.0)


def test_strengths_of_pairs_are_those_of_reading_them(glimpse):
    other = key_of(scheme_of(symbols=(2, 2), ticks=600))
    short = glimpse_of_track(robot_track(KEY, "robot0", (0, 0), 2.0))
    codebooks = [other.codebook(), *decoy_codebooks(other, 2)]
    table = CoherencyDetector().strengths(codebooks, other.scheme.channels, [glimpse, short], 1.0)
    assert table.shape == (3, 2, 2)
    assert np.all(np.isnan(table[:, :, 1]))
    for row, channel in enumerate(other.scheme.channels):
        read = CoherencyDetector().read_channel(codebooks, channel, glimpse, 1.0)
        assert table[:, row, 0].tolist() == [reading.strength for reading in read]
