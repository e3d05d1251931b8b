"""Two hours of motion capture beside ten minutes: time for each second of recording, and peak memory.

`pytest tests/benchmarks/test_long_recordings.py --benchmark-enable -s` prints both.
"""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.protocol import save_key
from tests.audit.moving_robot import key_of, robot_track, scheme_of

ROOT = Path(__file__).parents[2]
KEY = key_of(scheme_of(symbols=(2,), ticks=600, alphabet=8))
MEASURE = """
import resource, sys
from mtm_audit.cli import main
try:
    main(sys.argv[1:])
finally:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024, file=sys.stderr)
"""

pytestmark = pytest.mark.skipif("not config.getoption('benchmark_enable')", reason="measures; see the docstring")


def write_recording(path, seconds, first_s):
    """A robot that wanders at 100 positions a second and sends for the minute from `first_s` on, as a table."""
    rng, times_s = np.random.default_rng(1), np.arange(round(seconds * 100.0)) / 100.0
    steps = np.diff(np.cumsum(0.02 * rng.standard_normal((len(times_s) + 1, 2)), axis=0), axis=0) / 100.0
    sending = robot_track(KEY, "robot0", (3, 6), 60.0, onset_s=0.0, seed=2)
    first = round(first_s * 100.0)
    steps[first + 1 : first + len(sending.times_s)] = np.diff(sending.positions, axis=0)
    table = np.column_stack([times_s, np.cumsum(steps, axis=0)])
    np.savetxt(path, table, fmt="%.4f", delimiter=",", header="time,x,y", comments="")


def decode(folder, path):
    """CPU seconds, peak memory in bytes, and what was printed."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", MEASURE, "decode", str(path), "--key", str(folder / "robot.key")]
    done = subprocess.run(command, env=environment, capture_output=True, check=False, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode in (0, 4), done.stderr
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu_s, int(done.stderr.strip().splitlines()[-1]), done.stdout


def test_two_hours_cost_what_ten_minutes_do_for_each_second(tmp_path):
    save_key(KEY, tmp_path / "robot.key")
    cost, begun_s = {}, time.monotonic()
    for seconds, first_s in ((660.0, 300.0), (7200.0, 5000.0)):
        path = tmp_path / f"robot0_{seconds:.0f}.csv"
        write_recording(path, seconds, first_s)
        cpu_s, memory_bytes, said = decode(tmp_path, path)
        cost[seconds] = cpu_s / seconds
        print(f"\n{seconds:.0f} s: {cpu_s:.1f} CPU s, {memory_bytes / 1e6:.0f} MB; {said.splitlines()[0]}")
        assert memory_bytes < 1e9
    print(f"cost of a second: {cost[7200.0] / cost[660.0]:.2f} times; {time.monotonic() - begun_s:.0f} s in all")
    assert cost[7200.0] <= 1.2 * cost[660.0]
