"""One robot's message whose start a clock tells to a second: the search finds it at the rate of the channel."""

from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.matched.correlate import prepare
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.search import search_timings
from mtm_audit.detectors.matched.windows import make_windows
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_onboard.protocol import Key
from mtm_onboard.protocol.slots import slot_at
from tests.audit.detectors.matched.fleet_motion import RATE_HZ, START_S, fleet_run, motions_of

# 2026-01-31 12:00:00 UTC, when a message of 16 s begins.
NOON_UNIX_S = 1_769_860_800.0
BY_CLOCK = OnsetRange(START_S - 1.0, START_S + 1.0)


def large_run(seed):
    """Twelve bits in two seconds, with which candidates of little gain would look worse than silence."""
    return fleet_run(seed, 800, alphabet=4096, per_channel=8, noon_unix_s=NOON_UNIX_S)


def searched(run, robot, key=None, cut=0):
    """The start found by one robot's motion alone, without the first `cut` positions."""
    track = run.tracks[robot]
    kept = replace(
        track, times_s=track.times_s[cut:], positions=track.positions[cut:], valid=track.valid[cut:], headings_rad=None
    )
    (motion,) = motions_of(run, [kept])
    prepared = prepare(motion, fit_recording_noise([motion], [motion.velocities]), 0)
    codebook = (key or run.key).codebook(slot_at(NOON_UNIX_S, run.key.scheme))
    return search_timings([(codebook, run.key.scheme.channels[robot])], prepared, BY_CLOCK)[0]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("robot", [0, 3])
def test_a_robot_is_found_alone_at_6_bits_a_second(seed, robot):
    found = searched(large_run(seed), robot)
    assert found.timing.onset_s == pytest.approx(START_S, abs=0.1)
    assert found.evidence > 5.0


def test_another_key_is_weaker_than_silence_at_every_start():
    other = Key("other", b"one more fake secret, only tests", large_run(1).key.scheme)
    assert searched(large_run(1), 0, other).evidence < 0.0


@pytest.mark.parametrize("cut", range(4))
def test_a_start_between_cells_is_found_as_well(cut):
    found = searched(large_run(2), 1, cut=cut)
    assert found.timing.onset_s == pytest.approx(START_S, abs=0.05)
    assert found.timing.rate_hz == pytest.approx(RATE_HZ, rel=1e-3)
    assert found.evidence > 5.0


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("late_s", [-0.02, 0.02])
def test_symbols_do_not_hang_on_a_hundredth_of_a_second(seed, late_s):
    """Where several symbols are likely in each window at first, and one robot has to show its plant by itself."""
    run = large_run(seed)
    codebook, channels = run.key.codebook(slot_at(NOON_UNIX_S, run.key.scheme)), run.key.scheme.channels
    right = []
    for channel, motion in zip(channels, motions_of(run), strict=True):
        windows = make_windows(codebook, channel, motion, Timing(START_S + late_s, RATE_HZ), 0, range(channel.symbols))
        found = estimate(windows, [motion], fit_recording_noise([motion], [motion.velocities]))
        sent = run.symbols[len(right) * channel.symbols :][: channel.symbols]
        right.append(int(np.sum(np.argmax(found.ratios, axis=1) == sent)))
    assert min(right) >= 6
    assert sum(right) >= 28
