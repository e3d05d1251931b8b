"""Long recordings, which are read in pieces."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.pieces import LONGEST_WHOLE_S, part_of_track, pieces_of
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_audit.reporting.text import piece_sentence
from mtm_onboard.protocol.errors import MtmError
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=600, alphabet=8))
SENT = (3, 6)


def still(seconds, rate_hz=10.0):
    times_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return Track("robot0", times_s, np.zeros((len(times_s), 2)), np.ones(len(times_s), dtype=bool))


def long_recording(seconds, first_s, last_s, secret=None):
    """A robot that wanders at 25 positions a second and sends from the one instant to the other only."""
    key = KEY if secret is None else key_of(KEY.scheme, secret)
    rng, times_s = np.random.default_rng(1), still(seconds, rate_hz=25.0).times_s
    wandering = np.cumsum(0.02 * rng.standard_normal((len(times_s), 2)), axis=0) / 25.0
    sending = robot_track(key, "robot0", SENT, last_s - first_s, onset_s=0.0, seed=2, rate_hz=25.0)
    moved = np.diff(sending.positions, axis=0, prepend=sending.positions[:1])
    first = int(np.searchsorted(times_s, first_s))
    steps = np.diff(wandering, axis=0, prepend=wandering[:1])
    steps[first : first + len(moved)] = moved
    return Track("robot0", times_s, np.cumsum(steps, axis=0), np.ones(len(times_s), dtype=bool))


@pytest.mark.parametrize("onset_s", [pytest.param(None, marks=pytest.mark.long), 400.0], ids=["searched", "known"])
def test_a_message_in_one_minute_of_eleven_is_found(onset_s):
    found = decode_tracks([long_recording(660.0, 400.0, 460.0)], KEY, DecodeSettings(onset_s=onset_s))
    assert found.verdict != "absent"
    assert found.symbols in (SENT, SENT[::-1])
    begin_s, end_s = found.piece
    assert begin_s < 400.0 < end_s
    assert piece_sentence(found).endswith(f"{begin_s:.0f} s to {end_s:.0f} s show.")


@pytest.mark.long
def test_another_key_finds_nothing_in_eleven_minutes():
    found = decode_tracks([long_recording(660.0, 400.0, 460.0, OTHER_SECRET)], KEY, DecodeSettings())
    assert found.verdict == "absent"
    assert "none of them" in piece_sentence(found)


@given(st.floats(LONGEST_WHOLE_S + 2.0, 20_000.0))
def test_every_instant_is_in_a_piece_and_every_message_whole(seconds):
    pieces = pieces_of([still(seconds, rate_hz=1.0)], KEY.scheme, None)
    assert [piece.count for piece in pieces] == [len(pieces)] * len(pieces)
    assert pieces[0].begin_s == 0.0
    assert pieces[-1].end_s >= seconds - 2.0
    message_s = KEY.scheme.message_ticks / KEY.scheme.rate_hz
    for one, other in pairwise(pieces):
        assert one.end_s - other.begin_s >= message_s - 1e-6
        assert one.end_s - one.begin_s <= LONGEST_WHOLE_S


def test_shorter_recordings_and_empty_ones_are_read_as_a_whole():
    assert pieces_of([still(LONGEST_WHOLE_S)], KEY.scheme, None) == []
    assert pieces_of([], KEY.scheme, None) == []


def test_tracks_and_headings_are_cut_alike():
    whole = replace(still(900.0), headings_rad=np.arange(9000.0))
    for piece in pieces_of([whole], KEY.scheme, None):
        (track,) = piece.tracks
        assert track.times_s[0] >= piece.begin_s
        assert track.headings_rad == pytest.approx(10.0 * track.times_s)


def test_times_that_are_not_seconds_are_refused():
    track = still(900.0)
    with pytest.raises(MtmError, match="check that the times are seconds"):
        decode_tracks([replace(track, times_s=1000.0 * track.times_s)], KEY, DecodeSettings())


def test_a_part_has_its_own_corners_and_headings():
    times_s = np.arange(10.0)
    corners = np.arange(80.0).reshape(10, 4, 2)
    whole = Track(
        name="marker0", times_s=times_s, positions=corners[:, 0], valid=np.ones(10, dtype=bool), unit="px",
        headings_rad=times_s, corners=corners,
    )  # fmt: skip
    part = part_of_track(whole, 3.0, 5.0)
    assert part.corners.tolist() == corners[3:5].tolist()
    assert part.headings_rad.tolist() == [3.0, 4.0]
    with pytest.raises(MtmError, match="times and corners differ in length"):
        replace(whole, corners=corners[1:])
