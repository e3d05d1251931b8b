from dataclasses import replace

import pytest

from hil.experiments.verdicts import thresholds
from hil.experiments.verdicts.thresholds import THRESHOLDS, decode_at
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from tests.audit.moving_robot import key_of, robot_track, scheme_of

PAIR = key_of(scheme_of(symbols=(1, 1), ticks=200))
KNOWN = DecodeSettings(onset_s=1.0)


def pair(symbols=(3, 1)):
    return [
        robot_track(PAIR, f"robot{n}", None if symbol is None else (symbol,), 5.6, onset_s=1.0, seed=n)
        for n, symbol in enumerate(symbols)
    ]


def exchanged():
    one, other = pair()
    return [replace(one, name="robot1"), replace(other, name="robot0")]


@pytest.mark.parametrize("tracks", [pair(), exchanged(), pair((3, None))], ids=["plain", "exchanged", "silent"])
def test_every_threshold_gets_the_verdict_of_a_decode_at_it(tracks):
    for threshold, decoding in zip(THRESHOLDS, decode_at(tracks, PAIR, KNOWN), strict=True):
        straight = decode_tracks(tracks, PAIR, replace(KNOWN, threshold=threshold))
        for field in ("verdict", "message", "symbols", "symbol_nats", "needed_nats"):
            assert getattr(decoding, field) == getattr(straight, field)
        assert [channel.exchanged for channel in decoding.channels] == [c.exchanged for c in straight.channels]


def test_a_single_track_is_decoded_once(monkeypatch):
    asked = []
    decode = thresholds.decode_tracks
    monkeypatch.setattr(thresholds, "decode_tracks", lambda *given: asked.append(given[2].threshold) or decode(*given))
    key = key_of(scheme_of(symbols=(1,), ticks=200))
    decode_at([robot_track(key, "robot0", (2,), 5.6, onset_s=1.0)], key, KNOWN)
    assert asked == [1e-4]
