"""Several recordings of one message, decoded together."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.together import Recorded, decode_together
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.slots import slot_start_unix_s
from mtm_onboard.runtime.message import message_of
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

ROLLING = scheme_of(symbols=(3,), ticks=240, alphabet=16, schedule="rolling")
FIXED = scheme_of(symbols=(3,), ticks=240, alphabet=16)
FRAMED = scheme_of(symbols=(6,), ticks=720, alphabet=16, schedule="rolling",
                   framing=Framing("integer", 8, check="tag", check_bits=16))  # fmt: skip
SENT = (5, 9, 5)


def turned(track, angle_rad):
    """The same motion before another camera."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return replace(track, positions=track.positions @ np.array([[cosine, sine], [-sine, cosine]]))


@cache
def recorded(scheme, seed, slot=0, onset_s=1.0, seconds=9.0, angle_rad=0.0, payload=None):
    key = key_of(scheme)
    symbols = SENT if payload is None else message_of(payload, key)
    track = robot_track(key, "robot0", symbols, seconds, onset_s=onset_s, seed=seed, first_slot=slot)
    at = None if scheme.schedule == "fixed" else RecordedAt(slot_start_unix_s(slot, scheme) - onset_s, 1.0)
    return Recorded((turned(track, angle_rad),), DecodeSettings(at=at))


def alone(one, scheme):
    return decode_tracks(one.tracks, key_of(scheme), one.settings)


def test_two_days_of_a_rolling_schedule_add_up():
    days = [recorded(ROLLING, 0, 1000), recorded(ROLLING, 1, 2000, onset_s=2.0, angle_rad=1.0)]
    own = [alone(day, ROLLING) for day in days]
    together, shown = decode_together(days, key_of(ROLLING))
    assert together.evidence.nats > 1.5 * max(each.evidence.nats for each in own)
    assert together.symbols[:2] == SENT[:2]
    assert together.symbol_nats[1] > max(each.symbol_nats[1] for each in own) + 3.0
    assert together.channels[0].reading.timing == own[shown].channels[0].reading.timing
    assert [each.evidence.nats for each in together.together] == [each.evidence.nats for each in own]


def test_a_copy_of_a_film_is_no_second_film():
    one = recorded(ROLLING, 0, 1000)
    together, _ = decode_together([one, one], key_of(ROLLING))
    assert together.evidence.nats < alone(one, ROLLING).evidence.nats + 3.0


def test_recordings_that_begin_at_other_symbols_are_turned():
    """Without a known first symbol each recording reads the message from where it begins."""
    both = [recorded(FIXED, 0, seconds=12.0), recorded(FIXED, 1, onset_s=-2.0, seconds=12.0)]
    own = [alone(one, FIXED) for one in both]
    assert own[0].symbols != own[1].symbols
    together, shown = decode_together(both, key_of(FIXED))
    assert together.symbols == own[shown].symbols
    assert together.evidence.nats > min(each.evidence.nats for each in own)


def test_another_key_finds_nothing_in_both():
    days = [recorded(ROLLING, 0, 1000), recorded(ROLLING, 1, 2000, onset_s=2.0, angle_rad=1.0)]
    together, _ = decode_together(days, key_of(ROLLING, OTHER_SECRET))
    assert (together.verdict, together.message) == ("absent", None)


def test_two_cameras_authenticate_a_frame_that_neither_does():
    """One saw the first half of the slot, the other one the second."""
    whole = recorded(FRAMED, 0, 1000, seconds=16.0, payload=77)
    track = whole.tracks[0]

    def part(begin_s, end_s):
        seen = (track.times_s >= begin_s) & (track.times_s < end_s)
        return Recorded((replace(track, times_s=track.times_s[seen], positions=track.positions[seen],
                                 valid=track.valid[seen]),), whole.settings)  # fmt: skip

    halves = [part(0.0, 8.5), part(7.9, 16.0)]
    assert all(alone(half, FRAMED).verdict != "decoded" for half in halves)
    together, _ = decode_together(halves, key_of(FRAMED))
    assert (together.verdict, together.message) == ("decoded", 77)
    assert together.frames[-1].message.authenticated


def test_what_cannot_be_added_up_is_refused():
    by_paper = replace(recorded(FIXED, 0), settings=DecodeSettings(detector="coherency", decoys=8))
    with pytest.raises(MtmError, match="only exact evidence can be added up"):
        decode_together([by_paper, by_paper], key_of(FIXED))
