"""Messages whose noise has a spectrum, from the modulator to the verdict."""

from functools import cache

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from tests.audit.moving_robot import FAKE_SECRET, OTHER_SECRET, key_of, robot_track, scheme_of

# A slope over the band, and a band with a faint floor beside it.
SLOPE = ((0.5, 0.0), (5.0, -6.0))
FLOOR = ((0.9, -10.0), (1.0, 0.0), (3.0, 0.0), (3.1, -10.0))
SENT, ONSET_S = (5,), 0.6


def key(spectrum, secret=FAKE_SECRET):
    return key_of(scheme_of(symbols=(1,), ticks=400, alphabet=8, spectrum=spectrum), secret)


@cache
def track(spectrum, seconds=17.5):
    return robot_track(key(spectrum), "robot0", SENT, seconds, onset_s=ONSET_S)


@pytest.mark.parametrize("spectrum", [SLOPE, FLOOR], ids=["slope", "floor"])
@pytest.mark.parametrize("onset_s", [ONSET_S, None], ids=["known", "searched"])
@pytest.mark.parametrize("detector", ["matched", "coherency"])
def test_a_message_is_decoded(spectrum, onset_s, detector):
    settings = DecodeSettings(detector=detector, onset_s=onset_s, decoys=30 if detector == "coherency" else None)
    decoding = decode_tracks([track(spectrum)], key(spectrum), settings)
    assert decoding.verdict == "decoded"
    assert decoding.symbols == SENT


@pytest.mark.parametrize("spectrum", [SLOPE, FLOOR], ids=["slope", "floor"])
def test_another_key_finds_nothing(spectrum):
    decoding = decode_tracks([track(spectrum)], key(spectrum, OTHER_SECRET), DecodeSettings(onset_s=ONSET_S))
    assert decoding.verdict == "absent"


def test_evidence_makes_use_of_the_spectrum():
    """The same waveforms taken for flat ones say less: each tone is then expected with another loudness."""
    steep = ((0.5, 0.0), (2.5, 0.0), (3.0, -25.0))
    found = []
    for expected in (steep, None):
        decoding = decode_tracks([track(steep)], key(expected), DecodeSettings(onset_s=ONSET_S))
        found.append(decoding.evidence.nats)
    assert found[0] > found[1] + 3.0
    assert np.isfinite(found[1])
