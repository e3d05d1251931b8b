"""Decoding against an earlier commit, in pairs in one run: CPU time of the whole program, and of its start.

`MTM_BASELINE=<commit> pytest tests/benchmarks/test_decode_speed.py --benchmark-enable -s` prints the ratios; without
the variable the commit is the last one that compared keys with decoys. Needs the repository's history.
"""

import os
import resource
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum_files
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Channel, Key, save_key
from mtm_onboard.protocol.slots import slot_start_unix_s
from tests.audit.moving_robot import robot_track
from tests.benchmarks.earlier_commit import ROOT, checkout

BASELINE = os.environ.get("MTM_BASELINE", "ae2e668")
FAKE_SECRET = bytes(range(32))
ROUNDS = 3
SLOT = 30_000_000
DECODE = "import sys; from mtm_audit.cli import main; main(sys.argv[1:])"
START = "import mtm_audit.commands.decode, mtm_audit.detectors.matched.detector"

pytestmark = pytest.mark.skipif("not config.getoption('benchmark_enable')", reason="measures; see the docstring")


@pytest.fixture(scope="module")
def baseline(tmp_path_factory):
    """A checkout of the earlier commit."""
    return checkout(BASELINE, tmp_path_factory.mktemp("baseline"))


def cpu_s(tree, code, *arguments):
    """User time of one run, and its peak memory so far in MB."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, check=False)
    assert done.returncode in (0, 3, 4), done.stderr
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def compare(baseline, code, *arguments):
    """Median ratio of the pairs, the earlier commit's time over ours."""
    pairs = [(cpu_s(baseline, code, *arguments), cpu_s(ROOT, code, *arguments)) for _ in range(ROUNDS)]
    ratios = sorted(then / now for then, now in pairs)
    return ratios[len(ratios) // 2], [f"{then:.2f} / {now:.2f}" for then, now in pairs]


def written(folder, scheme, symbols, seconds, names=None, first_slot=0):
    """Motion capture and key of a fleet that sends again and again from 1.5 s on."""
    key = Key("fake", FAKE_SECRET, scheme)
    save_key(key, folder / "robot.key")
    tracks = [
        robot_track(key, channel.body, own, seconds, onset_s=1.5, seed=row, first_slot=first_slot)
        for row, (channel, own) in enumerate(zip(scheme.channels, symbols, strict=True))
    ]
    if names:
        tracks = [replace(track, name=name) for track, name in zip(tracks, names, strict=True)]
    (folder / "mocap").mkdir()
    poses = [replace(track, headings_rad=np.zeros(len(track.times_s))) for track in tracks]
    write_tum_files(poses, folder / "mocap")
    return [str(folder / "mocap"), "--key", str(folder / "robot.key")]


def one_robot(alphabet, windows, ticks, **changes):
    channel = Channel("robot0", "robot0", ("vx", "vy"), windows, 0.1)
    return replace(
        fleet_scheme(ticks), alphabet_size=alphabet, message_ticks=windows * ticks, channels=(channel,), **changes
    )


def test_decode_is_quicker_than_with_decoys(benchmark, baseline, tmp_path):
    jobs = {
        "four named robots, 26 s": (fleet_scheme(600), [(2,), (3,), (0,), (1,)], 26.0, None),
        "M = 256, 8 windows, 60 s": (one_robot(256, 8, 100), [(7, 201, 33, 90, 150, 2, 255, 64)], 60.0, None),
        "four nameless robots, 26 s": (fleet_scheme(600), [(2,), (3,), (0,), (1,)], 26.0, ("a", "b", "c", "d")),
    }
    for number, (name, (scheme, symbols, seconds, names)) in enumerate(jobs.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        ratio, pairs = compare(baseline, DECODE, "decode", *written(folder, scheme, symbols, seconds, names))
        print(f"\n{name}: {ratio:.1f} times faster, {', '.join(pairs)} CPU s")
    folder = tmp_path / "rolling"
    folder.mkdir()
    scheme = one_robot(16, 4, 100, schedule="rolling")
    arguments = written(folder, scheme, [(3, 15, 9, 1)], 40.0, first_slot=SLOT)
    at = slot_start_unix_s(SLOT, scheme) - 1.5
    ratio, pairs = compare(baseline, DECODE, "decode", *arguments, "--at", iso(at))
    print(f"\nrolling, start within 30 s: {ratio:.1f} times faster, {', '.join(pairs)} CPU s")
    ratio, pairs = compare(baseline, START)
    print(f"\nstart: {ratio:.1f} times faster, {', '.join(pairs)} CPU s")
    benchmark.pedantic(lambda: None, rounds=1)


def iso(unix_s):
    from datetime import UTC, datetime

    return datetime.fromtimestamp(unix_s, UTC).isoformat()
