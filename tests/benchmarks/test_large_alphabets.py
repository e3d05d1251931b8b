"""Alphabets of 4096 and 65,536 symbols against an earlier commit, in pairs in one run: CPU time and peak memory, with
the right key and with another; and the peak memory of a whole decode of four robots, windows of four and two seconds.

`MTM_BASELINE=<commit> pytest tests/benchmarks/test_large_alphabets.py --benchmark-enable -s` prints the ratios; without
the variable the commit is the last one that weighed every candidate whole. Needs the repository's history.
"""

import os
import subprocess
import sys

import pytest

from tests.benchmarks.earlier_commit import ROOT, checkout

BASELINE = os.environ.get("MTM_BASELINE", "e9f232f")
ROUNDS = 3
# A minute of one robot, eight windows, onset and clock to be found; its waveforms are derived within the time.
READ = """
import resource, sys
from mtm_audit.detectors.matched.detector import MatchedDetector
from tests.audit.moving_robot import key_of
from tests.benchmarks.test_matched_speed import read, recording
key, symbols, observations = recording(int(sys.argv[1]))
if sys.argv[2] == "wrong":
    key = key_of(key.scheme, b"one more fake secret, only tests")
taken_s, right = read(MatchedDetector(), (key, symbols, observations))
print(taken_s, right, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""

# A minute of four robots on three axes, 16 symbols of 65,536 again and again; the start is known.
DECODE = """
import resource, sys
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.sensors.motion_capture import MotionCapture
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_onboard.protocol import Channel, Key, Scheme
axes, sigmas = ("vx", "vy", "wz"), (0.1, 0.1, 0.2)
names = [f"robot{number}" for number in range(4)]
channels = tuple(Channel(name, name, axes, 4, sigmas) for name in names)
scheme = Scheme(name="four", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=65_536,
                message_ticks=4 * int(sys.argv[1]), channels=channels)
key = Key("fake", b"not a real secret, only for test", scheme)
symbols = tuple(4001 * number % 65_536 for number in range(1, 17))
settings = RunSettings(key=key, symbols=symbols, seconds=60.0, seed=4, wire="direct", start_s=1.5)
tracks = motion_capture_tracks(run_lockstep(settings), settings.seed, MotionCapture())
found = decode_tracks(tracks, key, DecodeSettings(onset_s=1.5))
print(found.symbols == symbols, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""

pytestmark = pytest.mark.skipif("not config.getoption('benchmark_enable')", reason="measures; see the docstring")


@pytest.fixture(scope="module")
def baseline(tmp_path_factory):
    """A checkout of the earlier commit."""
    return checkout(BASELINE, tmp_path_factory.mktemp("baseline"))


def told_by(tree, program, *arguments):
    """What a program that runs in the tree, in a process of its own, prints."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", program, *arguments]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


def read_in(tree, alphabet, key="right"):
    """Processor time in seconds and peak memory in MB of one read, which finds the symbols with the right key alone."""
    taken_s, right, peak_mb = told_by(tree, READ, str(alphabet), key)
    assert right == str(key == "right")
    return float(taken_s), float(peak_mb)


def median(values):
    return sorted(values)[len(values) // 2]


def test_large_alphabets_take_what_4096_symbols_took(benchmark, baseline, capsys):
    rounds = [(read_in(baseline, 4096), read_in(ROOT, 4096), read_in(ROOT, 65_536)) for _ in range(ROUNDS)]
    quicker = median([then[0] / now[0] for then, now, _ in rounds])
    larger = median([large[0] / then[0] for then, _, large in rounds])
    peak_mb = max(large[1] for _, _, large in rounds)
    benchmark.extra_info.update(quicker=quicker, larger=larger, peak_mb=peak_mb)
    with capsys.disabled():
        for then, now, large in rounds:
            print(f"\n60 s: M = 4096 {then[0]:.1f} s then, {now[0]:.1f} s now; M = 65536 {large[0]:.1f} s, "
                  f"{large[1]:.0f} MB", end="")  # fmt: skip
        print(f"\nM = 4096 {quicker:.1f} times quicker; M = 65536 takes {larger:.2f} of what M = 4096 took")
    benchmark.pedantic(lambda: None, rounds=1)
    assert peak_mb < 500.0
    assert quicker > 5.0
    assert larger < 1.0


def test_a_wrong_key_of_a_large_alphabet_is_told_soon(benchmark, baseline, capsys):
    """All clock rates and onsets are searched in vain."""
    then, now = read_in(baseline, 4096, "wrong"), read_in(ROOT, 4096, "wrong")
    large = read_in(ROOT, 65_536, "wrong")
    benchmark.extra_info.update(quicker=then[0] / now[0], larger=large[0] / then[0], peak_mb=large[1])
    with capsys.disabled():
        print(f"\n60 s, another key: M = 4096 {then[0]:.1f} s then, {now[0]:.1f} s now; M = 65536 {large[0]:.1f} s, "
              f"{large[1]:.0f} MB, {large[0] / then[0]:.2f} of what M = 4096 took")  # fmt: skip
    benchmark.pedantic(lambda: None, rounds=1)
    assert large[1] < 500.0
    assert now[0] < then[0]
    assert large[0] < 2.5 * then[0]


@pytest.mark.parametrize("ticks", [200, 100])
def test_a_decode_of_four_robots_takes_half_a_gigabyte(benchmark, capsys, ticks):
    right, peak_mb = told_by(ROOT, DECODE, str(ticks))
    benchmark.extra_info["peak_mb"] = float(peak_mb)
    with capsys.disabled():
        print(f"\n60 s, four robots, x, y and yaw, M = 65536, T = {ticks}: {float(peak_mb):.0f} MB")
    benchmark.pedantic(lambda: None, rounds=1)
    assert right == "True"
    assert float(peak_mb) < 500.0
