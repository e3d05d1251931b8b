"""A batch of 100 short recordings on two cores beside one, in one run; and a second key beside the first on a film.

`pytest tests/benchmarks/test_batch_speed.py --benchmark-enable -s` prints the ratios.
"""

import csv
import os
import subprocess
import sys
import time

import pytest

from mtm_onboard.protocol import Key, save_key
from tests.audit.batch.recordings import record, save_keys
from tests.audit.filmed_robots import KEY as FILM_KEY
from tests.audit.filmed_robots import film_robots
from tests.audit.moving_robot import OTHER_SECRET

RECORDINGS, SEEDS = 100, 10

pytestmark = pytest.mark.skipif("not config.getoption('benchmark_enable')", reason="measures; see the docstring")


def wall_s(folder, *arguments):
    """Time of a whole run of the program."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    began_s = time.monotonic()
    command = [sys.executable, "-m", "mtm_audit", "batch", *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return time.monotonic() - began_s


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="compares times; this machine has one core")
def test_two_cores_read_a_hundred_recordings_in_half_the_time(tmp_path):
    save_keys(tmp_path)
    (tmp_path / "logs").mkdir()
    for seed in range(SEEDS):
        first = record(tmp_path / "logs" / f"{seed}-0.tum", seed % 4, seed=seed)
        for copy in range(1, RECORDINGS // SEEDS):
            (tmp_path / "logs" / f"{seed}-{copy}.tum").write_bytes(first.read_bytes())
    names = sorted(str(path.relative_to(tmp_path)) for path in (tmp_path / "logs").iterdir())

    def run(jobs):
        out, cache = f"{jobs}.csv", tmp_path / f"cache{jobs}"
        asked = ("--key", "fake.key", "--onset", "1", "--jobs", jobs, "--out", out, "--cache", cache)
        return wall_s(tmp_path, *names, *asked)

    one_s, two_s = run(1), run(2)
    tables = [(tmp_path / f"{jobs}.csv").read_text().splitlines() for jobs in (1, 2)]
    assert len(tables[0]) == RECORDINGS + 1
    assert [line.rpartition(",")[0] for line in tables[0]] == [line.rpartition(",")[0] for line in tables[1]]
    print(f"\n{RECORDINGS} recordings: {one_s:.1f} s with one job, {two_s:.1f} s with two, ratio {one_s / two_s:.2f}")
    assert one_s / two_s >= 1.8


def test_a_second_key_does_not_track_the_film_again(tmp_path):
    save_key(FILM_KEY, tmp_path / "fake.key")
    save_key(Key("other", OTHER_SECRET, FILM_KEY.scheme), tmp_path / "other.key")
    film_robots(tmp_path / "film.mp4")

    def row(key):
        asked = ("--onset", "0.5", "--jobs", "1", "--cache", tmp_path / "cache")
        wall_s(tmp_path, "film.mp4", "--key", f"{key}.key", "--out", f"{key}.csv", *asked)
        with (tmp_path / f"{key}.csv").open(newline="") as file:
            return float(next(csv.DictReader(file))["seconds"])

    first_s, second_s = row("fake"), row("other")
    print(f"\na film of 9 s: {first_s:.1f} s with the first key, {second_s:.1f} s with the second")
    assert second_s < first_s
