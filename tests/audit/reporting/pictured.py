"""Decodings of each kind, for the tests of pictures and reports."""

from functools import cache
from pathlib import Path

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recording import Recording
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1, 1), ticks=400))
OTHER_KEY = key_of(KEY.scheme, OTHER_SECRET)
SECONDS, ONSET_S = 18.0, 1.0


@cache
def track(number, name=None, symbol=3):
    """Motion capture of one robot that sends a symbol, or nothing, twice over."""
    sent = None if symbol is None else (symbol,)
    made = robot_track(KEY, f"robot{number}", sent, SECONDS, onset_s=ONSET_S, seed=number)
    return made if name is None else type(made)(name, made.times_s, made.positions, made.valid)


@cache
def both_sent():
    return decoding_of(track(0, symbol=3), track(1, symbol=1))


@cache
def under_another_key():
    return decoding_of(track(0, symbol=3), track(1, symbol=1), key=OTHER_KEY)


@cache
def one_unseen():
    return decoding_of(track(0, symbol=3))


@cache
def one_silent():
    return decoding_of(track(0, symbol=3), track(1, symbol=None))


@cache
def exchanged():
    """Each robot's motion is in the track that is named after the other."""
    return decoding_of(track(1, "robot0", 1), track(0, "robot1", 3))


def decoding_of(*tracks, key=KEY, **settings):
    """A recording of these tracks, and its decoding with a known onset."""
    recording = Recording((Path("motion.tum"),), "motion capture", tracks)
    return recording, decode_tracks(tracks, key, DecodeSettings(onset_s=ONSET_S, **settings))
