"""One robot's message whose start a clock tells to a second: the search finds it at the rate of the channel."""

import pytest

from mtm_audit.detectors.matched.correlate import prepare
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.search import search_timings
from mtm_audit.model.timing import OnsetRange
from mtm_onboard.protocol import Key
from mtm_onboard.protocol.slots import slot_at
from tests.audit.detectors.matched.fleet_motion import START_S, fleet_run, motions_of

# 2026-01-31 12:00:00 UTC, when a message of 16 s begins.
NOON_UNIX_S = 1_769_860_800.0
BY_CLOCK = OnsetRange(START_S - 1.0, START_S + 1.0)


def large_run(seed):
    """Twelve bits in two seconds, with which candidates of little gain would look worse than silence."""
    return fleet_run(seed, 800, alphabet=4096, per_channel=8, noon_unix_s=NOON_UNIX_S)


def searched(run, robot, key=None):
    motion = motions_of(run)[robot]
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
