"""Robots of one recording that share a timing, and robots that do not."""

from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.detectors.robustness import JOBS, read_under
from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.correlate import prepare
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.fleet import Member, share_timings
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.timing import Timing
from mtm_audit.significance.decoys import decoy_codebooks
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(2, 2, 2), ticks=400))
SYMBOLS = ((3, 0), (1, 2), (0, 1))
TRUE = Timing(-1.5, 50.0 * 1.01)
WRONG = Timing(-0.4, 47.0)
WINDOW_S = 200 / TRUE.rate_hz


def tracks(onsets_s=(TRUE.onset_s,) * 3, seconds=14.0):
    return [
        robot_track(KEY, f"robot{n}", SYMBOLS[n], seconds, onset_s=onset_s, rate_scale=1.01, seed=n)
        for n, onset_s in enumerate(onsets_s)
    ]


def fleet_of(tracks, searched):
    motions = [uniform_motion(glimpse_of_track(track), 5.0) for track in tracks]
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    return [
        Member(channel, prepare(motion, noise, row), searched[row])
        for row, (channel, motion) in enumerate(zip(KEY.scheme.channels, motions, strict=True))
    ]


def in_step(timing, true=TRUE):
    """Whether windows begin where the true ones do, to a fifth of the shortest tone, in the recording's middle."""
    middle_s = 7.0
    late = (middle_s - timing.onset_s) * timing.rate_hz - (middle_s - true.onset_s) * true.rate_hz
    return abs((late + 100.0) % 200.0 - 100.0) / 50.0 < 0.07


def read(onsets_s=(TRUE.onset_s,) * 3):
    seen = [
        Observation(channel, glimpse_of_track(track))
        for channel, track in zip(KEY.scheme.channels, tracks(onsets_s), strict=True)
    ]
    return MatchedDetector().read(KEY.codebook(), [], seen, None)


def test_robots_of_open_timing_are_read_by_their_fleet_s():
    """Three of these four robots find no timing by themselves."""
    job = {"alphabet_size": JOBS[1].alphabet_size, "ticks": JOBS[1].ticks, "windows": JOBS[1].windows}
    read = read_under({"condition": "clock 1 % off, start unknown", **job}, 505)
    assert read["right"] >= 0.9 * read["read"]


def test_a_robot_that_found_a_wrong_timing_takes_its_fleet_s():
    searched = [[Found(TRUE, 30.0)], [Found(TRUE, 30.0)], [Found(WRONG, -9.0)]]
    shared = share_timings([KEY.codebook()], fleet_of(tracks(), searched), None)
    assert all(in_step(found.timing) for (found,) in shared)
    assert shared[2][0].evidence > 0.0


def test_a_robot_with_a_start_of_its_own_keeps_it():
    own_s = TRUE.onset_s + 0.4 * WINDOW_S
    found = read((TRUE.onset_s, TRUE.onset_s, own_s))
    timings = [reading.reading.timing for reading in found]
    assert [in_step(timing) for timing in timings] == [True, True, False]
    assert in_step(timings[2], replace(TRUE, onset_s=own_s))


def test_robots_that_share_a_timing_count_their_windows_alike():
    onsets_s = [reading.reading.timing.onset_s for reading in read()]
    assert np.ptp(onsets_s) < 0.1


def test_a_robot_seen_later_counts_from_a_message_it_shows():
    late = tracks(seconds=30.0)
    shown = late[2].times_s >= 16.0
    late[2] = replace(
        late[2], times_s=late[2].times_s[shown], positions=late[2].positions[shown], valid=late[2].valid[shown]
    )
    searched = [[Found(TRUE, 30.0)], [Found(TRUE, 30.0)], [Found(WRONG, -9.0)]]
    first, _, last = (found.timing for (found,) in share_timings([KEY.codebook()], fleet_of(late, searched), None))
    messages = (last.onset_s - first.onset_s) * first.rate_hz / 400.0
    assert messages == pytest.approx(round(messages), abs=0.01)
    assert -2.0 * WINDOW_S < last.onset_s - 16.0 < 0.71 * WINDOW_S


def test_a_fleet_s_timings_do_not_depend_on_which_key_is_real():
    books = [KEY.codebook(), *decoy_codebooks(KEY, 2)]
    searched = [[Found(TRUE, 30.0), Found(WRONG, -7.0 - n), Found(Timing(0.3 * n, 51.0), -8.0)] for n in range(3)]
    plain = share_timings(books, fleet_of(tracks(), searched), None)
    turned = share_timings(books[::-1], fleet_of(tracks(), [row[::-1] for row in searched]), None)
    for robot, other in zip(plain, turned, strict=True):
        assert [found.timing for found in robot] == [found.timing for found in other[::-1]]
        assert [found.evidence for found in robot] == pytest.approx([found.evidence for found in other[::-1]])


def test_a_known_start_stays_and_only_the_rate_is_shared():
    onset_s = TRUE.onset_s + 2.0 * WINDOW_S
    searched = [[Found(Timing(onset_s, rate_hz), evidence)] for rate_hz, evidence in
                ((TRUE.rate_hz, 30.0), (TRUE.rate_hz, 30.0), (53.0, -9.0))]  # fmt: skip
    shared = share_timings([KEY.codebook()], fleet_of(tracks(), searched), onset_s)
    assert {found.timing.onset_s for (found,) in shared} == {onset_s}
    assert [found.timing.rate_hz for (found,) in shared] == pytest.approx([TRUE.rate_hz] * 3, rel=0.004)
