"""How much faster the paper's statistic is for many candidates at once, and how fast a whole recording is decoded."""

import time

import numpy as np
import pytest
from scipy import signal

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors.gcc_phat import RATE_SCALES
from mtm_audit.detectors.welch import mean_coherency, segment_spectra
from mtm_audit.model.glimpse import glimpse_of_track, tick_velocities
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import key_of, robot_track, scheme_of

pytestmark = pytest.mark.benchmark(timer=time.process_time)
KEY = key_of(scheme_of(symbols=(1,), ticks=600, alphabet=8))
CHANNEL = KEY.scheme.channels[0]


def one_by_one(candidates, observed, bins):
    """One call of scipy for each candidate, rate and axis."""
    ticks = candidates.shape[-1]
    length = min(128, ticks // 2)
    scores = np.empty((len(candidates), len(observed)))
    for row, sent in enumerate(candidates):
        for column, seen in enumerate(observed):
            squares = [
                signal.coherence(x, y, window="hann", nperseg=length, noverlap=3 * length // 4, nfft=ticks)[1][bins]
                for x, y in zip(sent, seen, strict=True)
            ]
            scores[row, column] = np.mean(np.sqrt(squares))
    return scores


def at_once(candidates, observed, bins):
    return mean_coherency(segment_spectra(candidates, bins), segment_spectra(observed, bins))


def processor_s(function, *arguments, repeats):
    """Processor time of one call, the best of `repeats`, and its result."""
    times_s = []
    for _ in range(repeats):
        start_s = time.process_time()
        result = function(*arguments)
        times_s.append(time.process_time() - start_s)
    return min(times_s), result


def test_all_candidates_at_once_are_ten_times_faster(capsys):
    codebook = Codebook(KEY.secret, KEY.scheme)
    glimpse = glimpse_of_track(robot_track(KEY, "robot0", (5,), 15.0))
    bins, candidates = codebook.bins(CHANNEL), codebook.samples(CHANNEL, 0)
    observed = np.stack([tick_velocities(glimpse, 0.0, float(rate), 600).T for rate in 50.0 * RATE_SCALES[::5]])
    slow_s, expected = processor_s(one_by_one, candidates, observed, bins, repeats=1)
    fast_s, scores = processor_s(at_once, candidates, observed, bins, repeats=5)
    with capsys.disabled():
        print(
            f"\n8 candidates, 21 rates, 2 axes, 600 ticks: {slow_s:.2f} s one by one, {1000 * fast_s:.1f} ms at once, "
            f"{slow_s / fast_s:.0f} times faster"
        )
    assert scores == pytest.approx(expected, abs=1e-9)
    assert slow_s / fast_s >= 10.0


def test_a_minute_of_motion_capture_is_decoded_in_three_seconds(benchmark, capsys):
    track = robot_track(KEY, "robot0", (5,), 60.0, onset_s=1.5)
    decoding = benchmark.pedantic(decode_tracks, ([track], KEY, DecodeSettings()), rounds=2)
    seconds = benchmark.stats.stats.min if benchmark.enabled else None
    assert (decoding.verdict, decoding.symbols) == ("decoded", (5,))
    if seconds is not None:
        with capsys.disabled():
            print(f"\n60 s, M = 8, all rates and onsets: {seconds:.2f} s, {60 / seconds:.0f} times real time")
        assert seconds < 3.0
