from dataclasses import replace
from functools import cache

import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.verdict import judged
from mtm_onboard.protocol.framing import Framing
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1,), ticks=400))
THRESHOLDS = (0.1, 0.01, 1e-4, 1e-12)


@cache
def tracks():
    return (robot_track(KEY, "robot0", (2,), 9.6, onset_s=1.0),)


def decoded(threshold, key=KEY):
    return decode_tracks(tracks(), key, DecodeSettings(onset_s=1.0, threshold=threshold))


@pytest.mark.parametrize("threshold", THRESHOLDS)
def test_a_decoding_is_judged_as_a_decode_at_that_threshold(threshold):
    again, straight = judged(decoded(1e-4), threshold), decoded(threshold)
    fields = ("verdict", "message", "symbols", "symbol_nats", "needed_nats", "uncertain", "settings")
    assert [getattr(again, field) for field in fields] == [getattr(straight, field) for field in fields]


def test_a_message_is_decoded_down_to_what_its_evidence_allows():
    assert [judged(decoded(1e-4), threshold).verdict for threshold in (0.1, 1e-4, 1e-200)] == [
        "decoded", "decoded", "absent",
    ]  # fmt: skip


def test_a_symbol_below_its_bound_leaves_a_present_message_open():
    faint = replace(decoded(1e-4), symbol_nats=(6.0,))
    assert [judged(faint, threshold).verdict for threshold in (0.1, 1e-4)] == ["decoded", "inconclusive"]


def test_a_message_whose_order_is_unknown_is_never_decoded():
    turned = replace(decoded(1e-4), order_known=False)
    assert (judged(turned, 0.1).verdict, judged(turned, 0.1).message) == ("inconclusive", None)


def test_a_wrong_key_stays_absent_at_any_usual_threshold():
    decoding = decoded(1e-4, key_of(KEY.scheme, OTHER_SECRET))
    assert {judged(decoding, threshold).verdict for threshold in THRESHOLDS} == {"absent"}


def test_frames_that_were_not_read_cannot_be_judged():
    decoding = decoded(1e-4)
    framed = replace(decoding, scheme=scheme_of(symbols=(30,), ticks=3000, framing=Framing("integer", 8)))
    with pytest.raises(ValueError, match="decode it at this threshold"):
        judged(framed, 1e-4)
