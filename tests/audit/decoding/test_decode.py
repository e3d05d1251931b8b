from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_audit.significance.evidence import Evidence
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import number_of_symbols, symbols_of_number
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KNOWN = DecodeSettings(detector="coherency", onset_s=1.0, decoys=30)
PAIR = key_of(scheme_of(symbols=(1, 1), ticks=400))
SENT = (3, 1)


@cache
def pair(symbols=SENT, seconds=10.0, onset_s=1.0):
    """Two robots, each with a symbol of its own; None for one that moves without a message."""
    return tuple(
        robot_track(PAIR, f"robot{n}", None if symbols[n] is None else (symbols[n],), seconds, onset_s=onset_s, seed=n)
        for n in range(2)
    )


def test_a_message_is_decoded():
    decoding = decode_tracks(pair(), PAIR, KNOWN)
    assert decoding.verdict == "decoded"
    assert decoding.symbols == SENT
    assert decoding.message == number_of_symbols(SENT, PAIR.scheme) == 13
    assert decoding.evidence.p_value < 1e-4
    assert not decoding.uncertain


def test_a_message_is_decoded_when_nobody_knows_when_it_began():
    decoding = decode_tracks(pair(), PAIR, DecodeSettings(detector="coherency", decoys=30))
    assert (decoding.verdict, decoding.message) == ("decoded", 13)
    for channel in decoding.channels:
        assert channel.reading is not None
        assert channel.reading.timing.onset_s == pytest.approx(1.0, abs=0.4)


def test_the_wrong_key_finds_nothing():
    decoding = decode_tracks(pair(), key_of(PAIR.scheme, OTHER_SECRET), KNOWN)
    assert (decoding.verdict, decoding.message) == ("absent", None)
    assert decoding.evidence.p_value > 0.001


def test_the_wrong_key_finds_nothing_however_long_it_searches():
    decoding = decode_tracks(pair(), key_of(PAIR.scheme, OTHER_SECRET), DecodeSettings(detector="coherency", decoys=30))
    assert (decoding.verdict, decoding.message) == ("absent", None)


@pytest.mark.parametrize("late_s", [1e5, 1e300])
def test_a_far_too_long_recording_is_refused_before_the_search(late_s):
    tracks = tuple(replace(track, times_s=np.append(track.times_s[:-1], late_s)) for track in pair())
    with pytest.raises(MtmError, match="no more than 86400 s can be searched; .*seconds"):
        decode_tracks(tracks, PAIR, DecodeSettings(detector="coherency", decoys=8))


def test_a_recording_shorter_than_a_tick_is_refused():
    tracks = tuple(replace(track, times_s=track.times_s * 1e-7) for track in pair())
    with pytest.raises(MtmError, match="no whole window"):
        decode_tracks(tracks, PAIR, DecodeSettings(detector="coherency", decoys=8))


def test_a_robot_that_stands_still_says_nothing():
    tracks = tuple(replace(track, positions=np.ones_like(track.positions)) for track in pair())
    assert decode_tracks(tracks, PAIR, DecodeSettings(detector="coherency", decoys=8)).verdict == "absent"


@pytest.mark.parametrize("onset_s", [1.0, None])
def test_robots_that_send_nothing_give_absent(onset_s):
    decoding = decode_tracks(pair((None, None)), PAIR, DecodeSettings(detector="coherency", onset_s=onset_s, decoys=12))
    assert (decoding.verdict, decoding.message) == ("absent", None)


def test_a_robot_not_in_the_recording_leaves_the_message_open():
    decoding = decode_tracks(pair()[:1], PAIR, KNOWN)
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.symbols == (3, None)
    assert decoding.uncertain == (1,)
    assert decoding.posteriors[1] == pytest.approx(0.25)


def test_a_robot_that_stays_silent_leaves_the_message_open():
    long = key_of(scheme_of(symbols=(1, 1), ticks=800))
    speaks = robot_track(long, "robot0", (3,), 18.0, onset_s=1.0)
    silent = robot_track(long, "robot1", None, 18.0, seed=1)
    decoding = decode_tracks([speaks, silent], long, replace(KNOWN, decoys=24))
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.symbols[0] == 3
    assert decoding.uncertain == (1,)


def test_symbols_that_spell_no_number_are_no_message():
    key = key_of(scheme_of(symbols=(1, 1), ticks=400, alphabet=3))
    tracks = [robot_track(key, f"robot{n}", (2,), 10.0, onset_s=1.0, seed=n) for n in range(2)]
    decoding = decode_tracks(tracks, key, KNOWN)
    assert decoding.symbols == (2, 2)
    assert number_of_symbols((2, 2), key.scheme) is None
    assert (decoding.verdict, decoding.message, decoding.uncertain) == ("inconclusive", None, ())


@pytest.mark.parametrize("pooling", ["mean", "majority"])
def test_robots_that_carry_the_same_message_are_pooled(pooling):
    key = key_of(scheme_of(symbols=(2, 2, 2), ticks=400, combine="same", pooling=pooling))
    tracks = [robot_track(key, f"robot{n}", (0, 2), 9.5, onset_s=1.0, seed=n) for n in range(3)]
    decoding = decode_tracks(tracks, key, KNOWN)
    assert (decoding.verdict, decoding.symbols, decoding.message) == ("decoded", (0, 2), 2)
    assert decoding.posteriors.shape == (2, 4)


@pytest.mark.parametrize("pooling", ["mean", "majority"])
def test_a_pooled_message_survives_a_missing_robot(pooling):
    key = key_of(scheme_of(symbols=(1, 1, 1), ticks=400, combine="same", pooling=pooling))
    tracks = [robot_track(key, f"robot{n}", (2,), 9.5, onset_s=1.0, seed=n) for n in range(2)]
    assert decode_tracks(tracks, key, KNOWN).symbols == (2,)


def test_a_recording_from_the_middle_of_a_message_is_read():
    key = key_of(scheme_of(symbols=(1, 1), ticks=400))
    tracks = [robot_track(key, f"robot{n}", (SENT[n],), 21.0, onset_s=-5.0, seed=n) for n in range(2)]
    decoding = decode_tracks(tracks, key, DecodeSettings(detector="coherency", decoys=30))
    assert (decoding.verdict, decoding.symbols) == ("decoded", SENT)


SEVERAL = key_of(scheme_of(symbols=(2,), ticks=600))


def test_a_repeated_message_of_unseen_beginning_is_not_joined():
    """3 1 3 1 3 is the message 3 1 or the message 1 3: neither may be called decoded."""
    track = robot_track(SEVERAL, "robot0", (3, 1), 26.0, onset_s=-4.0)
    decoding = decode_tracks([track], SEVERAL, DecodeSettings(detector="coherency", decoys=30))
    assert sorted(decoding.symbols) == [1, 3]
    assert (decoding.verdict, decoding.message, decoding.order_known) == ("inconclusive", None, False)


def test_a_repeated_message_of_given_beginning_is_joined():
    track = robot_track(SEVERAL, "robot0", (3, 1), 26.0, onset_s=-4.0)
    decoding = decode_tracks([track], SEVERAL, DecodeSettings(detector="coherency", onset_s=8.0, decoys=30))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3, 1))


def test_several_symbols_sent_once_need_no_onset():
    track = robot_track(SEVERAL, "robot0", (3, 1), 14.0, onset_s=1.0)
    decoding = decode_tracks([track], SEVERAL, DecodeSettings(detector="coherency", decoys=30))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3, 1))


def test_the_order_of_equal_symbols_does_not_matter():
    track = robot_track(SEVERAL, "robot0", (2, 2), 26.0, onset_s=-4.0)
    decoding = decode_tracks([track], SEVERAL, DecodeSettings(detector="coherency", decoys=30))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (2, 2))


def test_gaps_in_the_tracks_cost_little():
    holed = []
    for track in pair():
        valid = np.ones(len(track.times_s), dtype=bool)
        valid[200:260] = valid[600:640] = False
        holed.append(replace(track, valid=valid, positions=np.where(valid[:, None], track.positions, np.nan)))
    decoding = decode_tracks(holed, PAIR, KNOWN)
    assert (decoding.verdict, decoding.message) == ("decoded", 13)


def test_a_moved_turned_and_scaled_picture_says_the_same():
    """What a camera on the ceiling sees: pixels, an axis each turned a little, any origin."""
    turn = np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    seen = [replace(track, positions=300.0 * track.positions @ turn.T + 512.0, unit="px") for track in pair()]
    assert decode_tracks(seen, PAIR, KNOWN).message == 13


def test_every_decode_of_a_recording_says_the_same():
    one, other = decode_tracks(pair(), PAIR, KNOWN), decode_tracks(pair(), PAIR, KNOWN)
    assert one.evidence.p_value == other.evidence.p_value
    assert np.array_equal(one.posteriors, other.posteriors)


def test_tracks_can_be_assigned_by_hand():
    crossed = [replace(pair()[0], name="red"), replace(pair()[1], name="blue")]
    settings = replace(KNOWN, assignment={"robot0": "red", "robot1": "blue"})
    assert decode_tracks(crossed, PAIR, settings).message == 13


FLEET = key_of(scheme_of(symbols=(1, 1, 1), ticks=400))


@cache
def strangers(order=(2, 0, 1), seconds=10.0):
    """A fleet that sends 3 1 2, in tracks whose names say nothing; `order` is which robot each track shows."""
    sent = (3, 1, 2)
    shown = [robot_track(FLEET, f"robot{n}", (sent[n],), seconds, onset_s=1.0, seed=n) for n in order]
    return tuple(replace(track, name=f"thing {letter}") for track, letter in zip(shown, "abc", strict=False))


def found_by_body(decoding):
    return {item.channel.body: item.glimpse and item.glimpse.name for item in decoding.channels}


@pytest.mark.parametrize("onset_s", [1.0, None])
def test_tracks_whose_names_say_nothing_are_matched_by_search(onset_s):
    decoding = decode_tracks(strangers(), FLEET, DecodeSettings(detector="coherency", onset_s=onset_s, decoys=20))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3, 1, 2))
    assert found_by_body(decoding) == {"robot0": "thing b", "robot1": "thing c", "robot2": "thing a"}
    assert all(item.searched for item in decoding.channels)


def test_the_matched_detector_finds_each_body_s_track_too():
    key = key_of(scheme_of(symbols=(1, 1), ticks=200))
    shown = [robot_track(key, f"robot{n}", (SENT[n],), 5.0, onset_s=0.5, seed=n) for n in (1, 0)]
    crossed = [replace(track, name=name) for track, name in zip(shown, ("left", "right"), strict=True)]
    decoding = decode_tracks(crossed, key, DecodeSettings(onset_s=0.5, threshold=0.05))
    assert (decoding.verdict, decoding.symbols) == ("decoded", SENT)
    assert found_by_body(decoding) == {"robot0": "right", "robot1": "left"}


@pytest.mark.parametrize("onset_s", [1.0, None])
def test_the_wrong_key_finds_nothing_however_tracks_are_matched(onset_s):
    wrong = key_of(FLEET.scheme, OTHER_SECRET)
    decoding = decode_tracks(strangers(), wrong, DecodeSettings(detector="coherency", onset_s=onset_s, decoys=20))
    assert (decoding.verdict, decoding.message) == ("absent", None)
    assert decoding.evidence.p_value > 0.01


def test_tracks_of_others_are_left_out_of_the_search_for_bodies():
    silent = [replace(robot_track(FLEET, "robot0", None, 10.0, seed=3), name="passer-by")]
    silent += [Track("dot", np.arange(4.0), np.zeros((4, 2)), np.array([True, False, False, False]))]
    decoding = decode_tracks([*silent, *strangers()], FLEET, KNOWN)
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3, 1, 2))


def test_a_body_for_which_no_track_is_left_stays_unseen():
    decoding = decode_tracks(strangers(order=(2, 1)), FLEET, KNOWN)
    assert found_by_body(decoding) == {"robot0": None, "robot1": "thing b", "robot2": "thing a"}
    assert (decoding.verdict, decoding.symbols) == ("inconclusive", (None, 1, 2))


def test_named_tracks_are_settled_before_the_search():
    named = replace(strangers()[1], name="robot0")
    decoding = decode_tracks([strangers()[0], named, strangers()[2]], FLEET, KNOWN)
    assert decoding.verdict == "decoded"
    assert found_by_body(decoding) == {"robot0": "robot0", "robot1": "thing c", "robot2": "thing a"}
    assert [item.searched for item in decoding.channels] == [False, True, True]


def test_the_strength_is_the_mean_of_the_channels():
    for tracks in (strangers(), (*strangers()[:2], replace(strangers()[2], name="robot1"))):
        decoding = decode_tracks(tracks, FLEET, replace(KNOWN, decoys=8))
        shown = [item.reading.strength for item in decoding.channels if item.reading is not None]
        assert decoding.evidence.decoys.strength == pytest.approx(np.mean(shown))


def test_tracks_too_short_to_match_are_refused_in_a_sentence():
    with pytest.raises(MtmError, match="no track can be read as any channel; record longer"):
        decode_tracks(strangers(seconds=4.0), FLEET, KNOWN)
    with pytest.raises(MtmError, match="at least 3"):
        decode_tracks(
            [Track("dot", np.zeros(1), np.zeros((1, 2)), np.ones(1, bool))], PAIR, replace(KNOWN, onset_s=None)
        )


def test_evidence_in_bits_is_what_the_p_value_says():
    by_coherency = decode_tracks(pair(), PAIR, KNOWN)
    assert by_coherency.evidence.nats is None
    assert by_coherency.evidence.bits == pytest.approx(-np.log2(by_coherency.evidence.p_value))
    by_likelihood = decode_tracks(pair(), PAIR, replace(KNOWN, detector="matched", decoys=None)).evidence
    assert by_likelihood.bits == pytest.approx(by_likelihood.nats / np.log(2.0))
    assert by_likelihood.p_value == pytest.approx(2.0**-by_likelihood.bits)


def test_progress_is_told():
    told = []
    decode_tracks(pair(), PAIR, replace(KNOWN, decoys=8), lambda stage, fraction: told.append((stage, fraction)))
    fractions = [fraction for _, fraction in told]
    assert fractions[0] == 0.0
    assert fractions == sorted(fractions)
    assert len(set(fractions)) > 1
    assert fractions[-1] <= 1.0
    assert all(stage.startswith("reading") for stage, _ in told)


def test_a_recording_too_short_for_any_window_is_refused():
    with pytest.raises(MtmError, match="no whole window"):
        decode_tracks(pair(seconds=4.0), PAIR, KNOWN)


def test_a_body_hardly_ever_seen_is_refused():
    times_s = np.arange(500) / 50
    valid = np.zeros(500, dtype=bool)
    valid[:2] = True
    track = Track("robot0", times_s, np.where(valid[:, None], 0.0, np.full((500, 2), np.nan)), valid)
    with pytest.raises(MtmError, match="at least 3"):
        decode_tracks([track], PAIR, KNOWN)


@pytest.mark.parametrize("number", [0, 7, 15])
def test_any_number_comes_back(number):
    symbols = symbols_of_number(number, PAIR.scheme)
    assert decode_tracks(pair(symbols), PAIR, KNOWN).message == number


def test_an_impossible_position_is_refused_before_the_sums():
    with pytest.raises(MtmError, match="beyond 1e\\+09 m"):
        Track("robot0", np.arange(3.0), np.array([[0.0, 0.0], [1e300, 0.0], [0.0, 0.0]]), np.ones(3, bool))


@pytest.mark.parametrize(
    ("p_value", "looks"), [(0.5, [30]), (0.011, [30]), (0.009, [30, 150]), (0.0002, [30, 150]), (0.00009, [30])]
)
def test_evidence_near_the_limit_gets_more_decoys_and_only_then(monkeypatch, p_value, looks):
    found = decode_tracks(pair(), PAIR, KNOWN)
    tried = []

    def decoded(tracks, key, settings, progress):
        tried.append(settings.decoys)
        evidence = Evidence(None, replace(found.evidence.decoys, p_value=p_value))
        return replace(found, verdict="absent", evidence=evidence, settings=settings), None

    monkeypatch.setattr("mtm_audit.decoding.decode.decoded_once", decoded)
    assert decode_tracks(pair(), PAIR, KNOWN).settings.decoys == looks[-1]
    assert tried == looks
