"""What a person is told beside the verdict: warnings, advice, and probabilities in words."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.advice import advice
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.text import percent, rarity
from mtm_audit.significance.evidence import Evidence
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1, 1), ticks=400))


@cache
def track(number=0, seconds=10.0, onset_s=1.0, rate_scale=1.0, rate_hz=100.0):
    return robot_track(
        KEY, f"robot{number}", (2,), seconds, onset_s=onset_s, rate_scale=rate_scale, seed=number, rate_hz=rate_hz
    )


def told(*tracks, onset_s=1.0, warnings=(), decoys=20):
    recording = Recording((Path("recording.tum"),), "motion capture", tracks, warnings)
    decoding = decode_tracks(tracks, KEY, DecodeSettings(detector="coherency", onset_s=onset_s, decoys=decoys))
    return remarks(recording, decoding), advice(recording, decoding), decoding


def test_a_good_recording_needs_no_words():
    warnings, sentences, decoding = told(track(0), track(1))
    assert (warnings, sentences, decoding.verdict) == ((), (), "decoded")


def test_what_the_file_warned_of_comes_first():
    warnings, sentences, _ = told(track(0), warnings=("the file is damaged",))
    assert warnings[0] == "the file is damaged"
    assert warnings[1].startswith("no track shows robot1")
    assert warnings[2:] == sentences


def test_what_would_help_comes_last_among_the_warnings():
    warnings, sentences, decoding = told(track(0))
    assert decoding.verdict == "inconclusive"
    assert len(sentences) == 1
    assert warnings[-1:] == sentences


def test_a_recording_shorter_than_a_message_is_remarked():
    warnings, _, _ = told(track(0, seconds=7.0, onset_s=0.0), track(1, seconds=7.0, onset_s=0.0), onset_s=0.0)
    assert "the recording lasts 7.0 s and one message 8 s" in warnings[0]


def test_a_channel_without_a_track_is_remarked():
    warnings, _, _ = told(track(1))
    assert warnings == (
        "no track shows robot0, so channel robot0 was not read; film it, or use --assign",
        "not seen: symbol 0, the part of robot0; record that robot too, or name its track with --assign",
    )


def test_a_frame_rate_below_twice_the_band_s_top_is_remarked():
    warnings, _, _ = told(track(0, rate_hz=9.0), track(1, rate_hz=9.0))
    assert "9.0 observations a second are too few for a band up to 5 Hz" in warnings[0]


def test_a_clock_more_than_two_percent_off_is_remarked():
    tracks = [track(number, seconds=20.0, rate_scale=1.05) for number in range(2)]
    warnings, _, _ = told(*tracks, onset_s=None, decoys=12)
    assert any("instead of 50 Hz" in warning for warning in warnings)


def test_a_robot_out_of_sight_for_long_is_remarked():
    whole = track(0)
    valid = np.ones(len(whole.times_s), dtype=bool)
    valid[300:600] = False
    holed = replace(whole, valid=valid, positions=np.where(valid[:, None], whole.positions, np.nan))
    warnings, _, _ = told(holed, track(1))
    assert warnings == ("robot0 was out of sight for 30% of the time between its first and last sighting",)


def test_a_track_too_short_is_remarked_beside_one_that_is_read():
    warnings, _, decoding = told(track(0), track(1, seconds=3.0))
    assert any("the recording of 'robot1' holds no whole window of 8 s" in warning for warning in warnings)
    assert decoding.channels[1].state == "too short"
    assert decoding.symbols[1] is None


@cache
def of_a_silent_robot():
    silent = robot_track(KEY, "robot0", None, 20.0)
    return told(silent, decoys=20)[2]


def said_with(evidence):
    near = replace(of_a_silent_robot(), verdict="absent", evidence=evidence)
    return advice(Recording((Path("recording.tum"),), "motion capture", (track(),)), near)


NEAR_THE_LIMIT = [(0.5, 1), (0.011, 1), (0.009, 2), (0.0002, 2)]


@pytest.mark.parametrize(("p_value", "sentences"), NEAR_THE_LIMIT)
def test_a_message_nearly_found_is_not_called_absent(p_value, sentences):
    said = said_with(Evidence(None, replace(of_a_silent_robot().evidence.decoys, p_value=p_value)))
    assert len(said) == sentences
    assert sentences == 1 or "more decoy keys (--decoys 100)" in said[1]


@pytest.mark.parametrize(("p_value", "sentences"), NEAR_THE_LIMIT)
@pytest.mark.parametrize("with_decoys", [False, True])
def test_exact_evidence_near_the_limit_asks_for_no_decoys(p_value, sentences, with_decoys):
    decoys = replace(of_a_silent_robot().evidence.decoys, p_value=0.4) if with_decoys else None
    said = said_with(Evidence(-math.log(p_value), decoys))
    assert len(said) == sentences
    assert sentences == 1 or "do not take it for absent before a longer recording" in said[1]
    assert "--decoys" not in " ".join(said)


def test_an_absent_message_is_not_given_advice_about_symbols():
    wrong = key_of(KEY.scheme, b"one more fake secret, only tests")
    recording = Recording((Path("a.tum"),), "motion capture", (track(0), track(1)))
    decoding = decode_tracks(recording.tracks, wrong, DecodeSettings(detector="coherency", onset_s=1.0, decoys=20))
    (sentence,) = advice(recording, decoding)
    assert "symbol" not in sentence


@pytest.mark.parametrize(
    ("posterior", "words"),
    [(0.9, "roughly 16 s"), (0.7, "roughly 40 s"), (0.3, "10 times this recording would hardly")],
)
def test_the_advised_length_grows_with_the_doubt(posterior, words):
    recording = Recording((Path("a.tum"),), "motion capture", (track(0), track(1)))
    decoding = decode_tracks(recording.tracks, KEY, DecodeSettings(detector="coherency", onset_s=1.0, decoys=20))
    posteriors = decoding.posteriors.copy()
    posteriors[1] = (1.0 - posterior) / 3.0
    posteriors[1, 2] = posterior
    doubtful = replace(decoding, verdict="inconclusive", message=None, posteriors=posteriors)
    (sentence,) = advice(recording, doubtful)
    assert sentence.startswith("uncertain: symbol 1, the part of robot1; ")
    assert words in sentence


@pytest.mark.parametrize(
    ("probability", "words"),
    [(1.0, "100 in 100"), (0.43, "43 in 100"), (0.004, "1 in 250"), (1e-4, "1 in 10,000"), (3.2e-15, "1 in 3e14")],
)
def test_probabilities_are_said_in_words(probability, words):
    assert rarity(probability) == words


@given(st.floats(0.0, 1.0))
def test_certainty_is_never_claimed(probability):
    assert percent(probability) != "100.0 %"
    assert rarity(probability)
