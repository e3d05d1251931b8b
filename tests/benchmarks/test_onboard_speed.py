"""Time of one tick on the robot; `make bench` shows it."""

from itertools import count

import pytest

from mtm_onboard.guard import Guard, Limits, Staleness
from mtm_onboard.modulator import Modulator
from mtm_onboard.motion import BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, Scheme
from mtm_onboard.runtime import Runtime
from mtm_onboard.source import HeldSource
from mtm_onboard.transports.none import NullTransport

BASE = BodyVelocity(0.3, 0.1, 0.2)


def modulator(schedule: str) -> Modulator:
    scheme = Scheme(
        name="test", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=600,
        channels=(Channel("a", "a", ("vx", "vy"), 1, 0.1),), schedule=schedule,
    )  # fmt: skip
    return Modulator(Codebook(b"not a real secret, only for test", scheme), "a", (2,))


def guard() -> Guard:
    return Guard(Limits(1.0, 2.0), Staleness(), noise_sigma=0.1, period_s=0.02)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_modulator_and_guard_take_a_few_microseconds_a_tick(benchmark, schedule):
    plays, checks, ticks = modulator(schedule), guard(), count()

    def tick() -> BodyVelocity:
        number = next(ticks)
        now_s = number / 50.0
        base = checks.admit(BASE, now_s, now_s)
        sent = checks.limit(base, plays.add(number, base))
        plays.prepare(number)
        return sent

    assert benchmark(tick) != BASE


def test_a_whole_tick_on_a_trivial_link_takes_a_few_microseconds(benchmark):
    source, link, ticks = HeldSource(), NullTransport(), count()
    runtime = Runtime(modulator("fixed"), guard(), source, link)

    def tick() -> None:
        number = next(ticks)
        source.set(BASE, number / 50.0)
        runtime.step(number, number / 50.0)

    benchmark(tick)
    assert link.sent > 0
