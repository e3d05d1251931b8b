from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.reporting.delivery import clock_sentence, frame_sentences, late_s
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.slots import slot_at
from mtm_onboard.runtime.message import message_of
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

TAGGED = Framing("integer", 12, check="tag", check_bits=16, code="reed-solomon")
# Two robots with five windows of 2 s each: 28 bits of data in seven of ten symbols of four bits.
SCHEME = scheme_of(symbols=(5, 5), ticks=500, alphabet=16, framing=TAGGED)
KEY = key_of(SCHEME)
SETTINGS = DecodeSettings()


@cache
def tracks(payload=1234, key=KEY, seconds=22.0, onset_s=1.0, first_slot=0):
    message = message_of(payload, key)
    return tuple(
        robot_track(key, f"robot{n}", message, seconds, onset_s=onset_s, seed=n, first_slot=first_slot)
        for n in range(2)
    )


def test_a_tagged_frame_is_authenticated():
    decoding = decode_tracks(tracks(), KEY, replace(SETTINGS, onset_s=1.0))
    assert (decoding.verdict, decoding.message) == ("decoded", 1234)
    assert decoding.frames[0].message.authenticated
    assert "had the key" in frame_sentences(decoding)[0]


def test_the_tag_finds_the_first_symbol_of_a_repeated_message():
    decoding = decode_tracks(tracks(onset_s=-3.2), KEY, SETTINGS)
    assert (decoding.verdict, decoding.message) == ("decoded", 1234)


def test_another_key_sees_no_message():
    decoding = decode_tracks(tracks(), key_of(SCHEME, OTHER_SECRET), replace(SETTINGS, onset_s=1.0))
    assert (decoding.verdict, decoding.message, decoding.frames) == ("absent", None, ())


def test_a_robot_out_of_sight_is_filled_in_by_the_code():
    strong = key_of(replace(SCHEME, framing=Framing("integer", 4, check="tag", check_bits=16, code="reed-solomon")))
    sent = tracks(payload=9, key=strong)
    hidden = sent[1].valid & (sent[1].times_s < 10.0)
    half = replace(sent[1], valid=hidden, positions=np.where(hidden[:, None], sent[1].positions, np.nan))
    decoding = decode_tracks([sent[0], half], strong, replace(SETTINGS, onset_s=1.0))
    assert (decoding.verdict, decoding.message) == ("decoded", 9)


def test_a_message_that_changes_on_the_way_is_told_as_two():
    first, second = (tracks(payload=payload) for payload in (1234, 77))
    spliced = []
    for before, after in zip(first, second, strict=True):
        late = before.times_s >= 11.0
        # The second half goes on from where the first one ended.
        step = before.positions[late][0] - after.positions[late][0]
        spliced.append(replace(before, positions=np.where(late[:, None], after.positions + step, before.positions)))
    decoding = decode_tracks(spliced, KEY, replace(SETTINGS, onset_s=1.0))
    assert [frame.message.payload for frame in decoding.frames] == [1234, 77]
    assert decoding.message == 77


ROLLING = key_of(scheme_of(symbols=(5, 5), ticks=500, alphabet=16, framing=TAGGED, schedule="rolling"))
# 2026-01-31 12:00:00 UTC, a slot's start.
NOON_S = 1_769_860_800.0


def rolling_tracks():
    """Sent from noon on; the recording begins a second earlier."""
    return tracks(key=ROLLING, first_slot=slot_at(NOON_S, ROLLING.scheme))


@pytest.mark.parametrize("clock_s", [-4.0, 0.0, 7.5])
def test_a_rolling_message_is_found_by_the_clock(clock_s):
    sent = rolling_tracks()
    settings = replace(SETTINGS, at=RecordedAt(NOON_S - 1.0 + clock_s, 8.0))
    decoding = decode_tracks(sent, ROLLING, settings)
    assert (decoding.verdict, decoding.message) == ("decoded", 1234)
    assert decoding.frames[0].message.authenticated
    assert "2026-01-31 12:00:00 UTC" in frame_sentences(decoding)[0]


@pytest.mark.parametrize("clock_s", [-4.0, 0.0, 7.5])
def test_a_motion_later_than_its_slot_may_be_a_relay(clock_s):
    # A recording whose clock is behind shows the motion early, and one whose clock is ahead, or a relay, shows it late.
    settings = replace(SETTINGS, at=RecordedAt(NOON_S - 1.0 + clock_s, 8.0))
    decoding = decode_tracks(rolling_tracks(), ROLLING, settings)
    assert late_s(decoding) == pytest.approx(clock_s, abs=0.3)
    told = clock_sentence(decoding)
    assert ("could be a relay of" in told) is (clock_s > 1.0)
    if clock_s > 1.0:
        assert f"relay of {late_s(decoding):.0f} s" in told
        assert "--at-error 2" in told


def test_yesterdays_motion_shown_today_is_no_message():
    settings = replace(SETTINGS, at=RecordedAt(NOON_S - 1.0 + 86_400.0, 8.0))
    assert decode_tracks(rolling_tracks(), ROLLING, settings).verdict == "absent"


def test_a_rolling_message_without_a_time_says_what_to_give():
    with pytest.raises(MtmError, match="say when the recording was made with --at"):
        decode_tracks(rolling_tracks(), ROLLING, SETTINGS)


def test_an_onset_where_no_slot_begins_is_refused():
    settings = replace(SETTINGS, onset_s=5.0, at=RecordedAt(NOON_S - 1.0, 0.5))
    with pytest.raises(MtmError, match="no message of this key begins at 5 s of the recording"):
        decode_tracks(rolling_tracks(), ROLLING, settings)
