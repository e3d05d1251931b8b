"""How fast the matched detector reads a minute of motion, how its cost grows, and how much memory it takes."""

import time
import tracemalloc

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.coherency import CoherencyDetector
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.significance.decoys import decoy_codebooks
from tests.audit.moving_robot import key_of, robot_track, scheme_of

pytestmark = pytest.mark.benchmark(timer=time.process_time)
SECONDS = 60.0
DECOYS = 40
WINDOW_TICKS = 370
MEGABYTE = 1e6


def recording(alphabet, seconds=SECONDS):
    """A key of eight windows a minute and the motion of a robot that sends; onset and clock are to be found."""
    windows = round(8 * seconds / 60.0)
    key = key_of(scheme_of(symbols=(windows,), ticks=windows * WINDOW_TICKS, alphabet=alphabet))
    symbols = tuple((37 * number + 5) % alphabet for number in range(windows))
    track = robot_track(key, "robot0", symbols, seconds, onset_s=0.4)
    return key, symbols, [Observation(key.scheme.channels[0], glimpse_of_track(track))]


def read(detector, case, decoys=0):
    """Processor time of one read from a key on, its waveforms included, and whether it found the symbols.

    Which of them comes first nothing says while the message repeats.
    """
    key, symbols, observations = case
    start_s = time.process_time()
    (found,) = detector.read(key.codebook(), decoy_codebooks(key, decoys), observations, None)
    taken_s = time.process_time() - start_s
    best = found.reading.scores.argmax(axis=1)
    return taken_s, any(np.array_equal(np.roll(best, turn), symbols) for turn in range(len(best)))


def coherency_s(case):
    """Processor time of the paper's detector for the same, which has no decoys to compare with either."""
    key, _, (observation,) = case
    start_s = time.process_time()
    CoherencyDetector().read_channel([key.codebook()], observation.channel, observation.glimpse, None)
    return time.process_time() - start_s


def measured(benchmark, case, *, decoys=0, rounds=2):
    """Processor time of the best round, or None when nothing is to be measured."""
    _, is_right = benchmark.pedantic(read, (MatchedDetector(), case, decoys), rounds=rounds)
    assert is_right
    if not benchmark.enabled:
        return None
    taken_s = benchmark.stats.stats.min
    benchmark.extra_info["times_real_time"] = SECONDS / taken_s
    return taken_s


def test_a_minute_of_256_symbols_is_30_times_real_time(benchmark, capsys):
    case = recording(256)
    taken_s = measured(benchmark, case)
    if taken_s is not None:
        other_s = coherency_s(case)
        benchmark.extra_info["coherency_over_matched"] = other_s / taken_s
        with capsys.disabled():
            print(
                f"\n60 s, M = 256, all rates and onsets: {taken_s:.2f} s, {SECONDS / taken_s:.0f} times real time; "
                f"coherency {other_s:.2f} s, {SECONDS / other_s:.1f} times; {other_s / taken_s:.1f} to 1"
            )
        assert SECONDS / taken_s >= 30.0


def test_a_minute_of_4096_symbols_is_5_times_real_time(benchmark, capsys):
    taken_s = measured(benchmark, recording(4096), rounds=1)
    if taken_s is not None:
        with capsys.disabled():
            print(f"\n60 s, M = 4096: {taken_s:.2f} s, {SECONDS / taken_s:.1f} times real time")
        assert SECONDS / taken_s >= 5.0


@pytest.mark.slow
def test_a_verdict_s_decoys_cost_what_they_cost(benchmark, capsys):
    taken_s = measured(benchmark, recording(256), decoys=DECOYS, rounds=1)
    if taken_s is not None:
        with capsys.disabled():
            print(f"\n60 s, M = 256, {DECOYS} decoys: {taken_s:.2f} s, {SECONDS / taken_s:.1f} times real time")
        assert SECONDS / taken_s >= 1.0


@pytest.mark.parametrize("alphabet", [256, 4096, pytest.param(65_536, marks=pytest.mark.slow)])
def test_half_a_gigabyte_of_memory_is_enough(benchmark, capsys, alphabet):
    case = recording(alphabet)
    tracemalloc.start()
    try:
        benchmark.pedantic(read, (MatchedDetector(), case), rounds=1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    benchmark.extra_info["peak_megabytes"] = peak / MEGABYTE
    if benchmark.enabled:
        with capsys.disabled():
            print(f"\n60 s, M = {alphabet}: {peak / MEGABYTE:.0f} MB at the most")
    assert peak < 500 * MEGABYTE


def test_cost_grows_no_faster_than_recording_and_alphabet(benchmark, capsys):
    if not benchmark.enabled:
        pytest.skip("compares times; run with --benchmark-enable")
    plain, longer, larger = recording(256), recording(256, 4.0 * SECONDS), recording(1024)
    plain_s = measured(benchmark, plain)
    longer_s, larger_s = (min(read(MatchedDetector(), case)[0] for _ in range(2)) for case in (longer, larger))
    benchmark.extra_info |= {"four_times_longer": longer_s / plain_s, "four_times_the_alphabet": larger_s / plain_s}
    with capsys.disabled():
        print(
            f"\nfour times as long: {longer_s / plain_s:.1f} times the cost; M = 1024: {larger_s / plain_s:.1f} times"
        )
    assert longer_s / plain_s < 1.3 * 4.0
    assert larger_s / plain_s < 1.3 * 4.0
