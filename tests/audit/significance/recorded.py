"""A recording that the key had no part in, and its terms under any key, for the tests of evidence."""

from dataclasses import replace
from functools import cache

import numpy as np

from mtm_audit.detectors.base import ChannelReading, Reading
from mtm_audit.detectors.matched.candidates import stacked_tones
from mtm_audit.detectors.matched.correlate import Prepared, prepare
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.timing import Timing
from mtm_audit.significance.channel_terms import channel_terms
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

ONSET_S = 0.4


def secret(number):
    """The fake secret of that number."""
    return b"fake test secret number " + number.to_bytes(8, "big")


@cache
def prepared(seconds=10.0) -> Prepared:
    """A robot that drives its route and sends something of its own, whitened."""
    key = key_of(scheme_of(symbols=(2,), ticks=200, alphabet=8), OTHER_SECRET)
    motion = uniform_motion(glimpse_of_track(robot_track(key, "robot0", (5, 5), seconds, onset_s=ONSET_S)), 5.0)
    return prepare(motion, fit_recording_noise([motion], [motion.velocities]), 0)


def tones_of(scheme, number, played=0):
    """What the key stream of that number gives all symbols in one window: (M, axes, 2 K)."""
    return stacked_tones(Codebook(secret(number), scheme), scheme.channels[0], played).astype(float)


def reading(scheme, ready, windows, scores=None):
    """As if a detector had read so many windows from the onset on; `scores` (windows, M) order the candidates."""
    channel = scheme.channels[0]
    numbers = np.arange(windows)
    positions = np.mod(numbers, channel.symbols)
    scores = np.zeros((windows, scheme.alphabet_size)) if scores is None else scores
    summed = np.zeros((channel.symbols, scheme.alphabet_size))
    np.add.at(summed, positions, scores)
    timing = Timing(ONSET_S, scheme.rate_hz)
    starts_s = ONSET_S + numbers * scheme.window_ticks(channel) / scheme.rate_hz
    found = Reading(timing, summed, scores, numbers, positions, starts_s, 1.0)
    return ChannelReading(found, summed, scores, np.zeros(0), ready)


def terms_of(scheme, codebook, ready, windows, onset=ONSET_S, scores=None, *, apart=False):
    """The channel's terms under a codebook; candidates in the order of the `scores`."""
    found = reading(scheme, ready, windows, scores)
    return channel_terms(codebook, scheme.channels[0], found, onset, apart=apart)


def without_motion(ready, *, seen=True):
    """The same recording, standing still, or never seen."""
    weights = ready.weights if seen else np.zeros_like(ready.weights)
    return replace(ready, filtered=np.zeros_like(ready.filtered), weights=weights)
