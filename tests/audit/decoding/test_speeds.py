import math
from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.paid import paid_for
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import SPEEDS, at_speed, decode_at_speeds, played
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.runtime.message import message_of
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1, 1), ticks=200))
SYMBOLS = (3, 1)
SETTINGS = DecodeSettings()


@pytest.fixture(scope="module")
def tracks():
    """Two robots that send, at 50 observations a second."""
    return tuple(
        robot_track(KEY, f"robot{number}", (symbol,), 9.0, onset_s=0.5, seed=number, rate_hz=50.0)
        for number, symbol in enumerate(SYMBOLS)
    )


@pytest.fixture(scope="module")
def decoding(tracks):
    return decode_tracks(tracks, KEY, SETTINGS)


def slowed(tracks, factor, shift_s=0.0):
    return tuple(replace(track, times_s=factor * track.times_s + shift_s) for track in tracks)


def test_what_is_played_keeps_its_first_instant(tracks):
    fast = played(slowed(tracks, 4.0, shift_s=50_000.0), 4.0)
    assert fast[0].times_s == pytest.approx(50_000.0 + tracks[0].times_s)
    assert np.array_equal(fast[0].positions, tracks[0].positions)


def test_an_onset_moves_with_the_film(tracks):
    slow = slowed(tracks, 4.0, shift_s=100.0)
    assert at_speed(DecodeSettings(onset_s=102.0), slow, 4.0).onset_s == pytest.approx(100.5)
    assert at_speed(SETTINGS, slow, 4.0).onset_s is None


@pytest.mark.parametrize("speed", [0.0, -1.0, math.inf, math.nan])
def test_nothing_can_be_played_at_such_a_speed(tracks, speed):
    with pytest.raises(MtmError, match="above zero"):
        played(tracks, speed)


def test_every_e_value_pays_for_the_search(decoding):
    paid = paid_for(decoding, 15)
    assert decoding.evidence.nats - paid.evidence.nats == pytest.approx(math.log(15))
    pairs = zip(decoding.symbol_nats, paid.symbol_nats, strict=True)
    assert [before - after for before, after in pairs] == pytest.approx([math.log(15)] * 2)
    assert paid.verdict == decoding.verdict == "decoded"


def test_a_search_that_costs_too_much_takes_the_verdict_back(decoding):
    assert paid_for(decoding, 10**30).verdict == "absent"
    spare = min(decoding.symbol_nats) - decoding.needed_nats
    doubtful = paid_for(decoding, math.ceil(math.exp(spare + 1.0)))
    assert doubtful.verdict == "inconclusive"
    assert doubtful.message is None


def test_the_checks_of_a_frame_count_for_every_speed():
    framing = Framing("integer", 12, check="tag", check_bits=16, code="reed-solomon")
    key = key_of(scheme_of(symbols=(5, 5), ticks=500, alphabet=16, framing=framing))
    message = message_of(1234, key)
    sent = [robot_track(key, f"robot{number}", message, 22.0, onset_s=1.0, seed=number) for number in range(2)]
    framed = decode_tracks(sent, key, DecodeSettings(onset_s=1.0))
    paid = paid_for(framed, 15)
    assert (paid.verdict, paid.message) == ("decoded", 1234)
    assert paid.frames[0].message.false_acceptance == pytest.approx(15 * framed.frames[0].message.false_acceptance)


def test_a_comparison_with_decoys_pays_too():
    framed = key_of(scheme_of(symbols=(1,), ticks=200))
    track = robot_track(framed, "robot0", None, 9.0, rate_hz=50.0)
    coherency = decode_tracks([track], framed, DecodeSettings(detector="coherency", onset_s=0.5, decoys=8))
    paid = paid_for(coherency, 4)
    assert paid.evidence.p_value == pytest.approx(min(1.0, 4.0 * coherency.evidence.p_value))


@pytest.mark.parametrize("speed", [4.0, 2 / 3])
def test_the_search_finds_the_speed(tracks, decoding, speed):
    found, decoded = decode_at_speeds(slowed(tracks, speed), KEY, SETTINGS)
    assert found == pytest.approx(speed)
    assert decoded.symbols == SYMBOLS
    assert decoded.evidence.bits == pytest.approx(decoding.evidence.bits - math.log2(len(SPEEDS)), abs=1.0)


@pytest.mark.slow
def test_the_search_finds_nothing_for_a_key_that_had_no_part(tracks):
    said = []
    _, decoded = decode_at_speeds(tracks, key_of(KEY.scheme, OTHER_SECRET), SETTINGS, lambda *step: said.append(step))
    assert decoded.verdict == "absent"
    assert {name.split(":")[0] for name, _ in said} == {f"speed {number} of 15" for number in range(1, 16)}
    assert all(0.0 <= fraction <= 1.0 for _, fraction in said)


def test_what_no_speed_can_read_is_refused_for_its_reason(tracks):
    with pytest.raises(MtmError, match="no more than 86400 s can be searched"):
        decode_at_speeds(slowed(tracks, 1e6), KEY, SETTINGS)


def test_the_speeds_reach_from_an_eighth_to_eight():
    assert len(set(SPEEDS)) == len(SPEEDS) == 15
    assert (min(SPEEDS), max(SPEEDS), SPEEDS[0]) == (0.125, 8.0, 1.0)
