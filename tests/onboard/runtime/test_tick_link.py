"""What the runtime makes of a link that comes and goes, and what it tells the journal of it."""

import math

import pytest

from hil.fleet.clock import SimulatedClock
from mtm_onboard.links.none import NullLink
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import HELD, NOISE, STOPPED, UNSENT
from mtm_onboard.runtime.guard import Guard, Limits, Staleness
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime

BASE = BodyVelocity(0.3, -0.1, 0.5)
NOISY = BodyVelocity(0.31, -0.1, 0.5)


class Link(ReconnectingLink):
    """Up since before the run, until somebody says otherwise; tells `calls` what it is given."""

    def __init__(self, calls: list) -> None:
        super().__init__(NullLink, SimulatedClock())
        self.sent: list[BodyVelocity] = []
        self._calls = calls

    def send(self, velocity: BodyVelocity) -> None:
        self._calls.append("send")
        if self.fault == "broken":
            raise OSError("cable pulled")
        self.sent.append(velocity)


class Noise:
    """Adds the same to every command."""

    def __init__(self, calls: list) -> None:
        self._calls = calls

    def require_body_axes(self) -> None:
        pass

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        self._calls.append(("add", tick))
        return NOISY

    def prepare(self, tick: int) -> None:
        self._calls.append(("prepare", tick))


class Notes:
    """What a journal is told."""

    hides_noise = False

    def __init__(self) -> None:
        self.rows: list[tuple[int, int]] = []
        self.events: list[tuple[int, str]] = []

    def append(self, tick, now_s, base, sent, flags, late_s) -> None:
        self.rows.append((tick, flags))

    def note(self, tick, text) -> None:
        self.events.append((tick, text))


class Robot:
    """A runtime that gets a fresh base command in each tick."""

    def __init__(self) -> None:
        self.calls: list = []
        self.link, self.journal, self.source = Link(self.calls), Notes(), HeldSource()
        guard = Guard(Limits(1.0, 2.0), Staleness(), noise_sigma=0.1, period_s=0.02)
        self.runtime = Runtime(Noise(self.calls), guard, self.source, self.link, self.journal)

    def tick(self, *ticks: int) -> list[BodyVelocity]:
        before = len(self.link.sent)
        for tick in ticks:
            self.source.set(BASE, tick / 50.0)
            self.runtime.step(tick, tick / 50.0)
        return self.link.sent[before:]

    def flags(self) -> list[int]:
        return [flags for _, flags in self.journal.rows]


def test_a_tick_adds_the_noise_sends_and_only_then_prepares():
    robot = Robot()
    assert robot.tick(7) == [NOISY]
    assert robot.calls == [("add", 7), "send", ("prepare", 7)]


def test_while_the_link_is_down_the_robot_is_held():
    robot = Robot()
    robot.tick(0, 1)
    robot.link.up_since_s, robot.link.fault = None, "cable pulled"
    assert robot.tick(2, 3, 4) == [STOP] * 3
    assert robot.flags() == [NOISE, NOISE, HELD, HELD, HELD]
    assert robot.runtime.link_losses == 1
    assert robot.journal.events == [(2, "the link was lost: cable pulled")]


def test_a_link_that_is_back_waits_for_a_new_command():
    robot = Robot()
    robot.link.up_since_s = None
    robot.tick(0)
    robot.link.up_since_s = 0.05
    # What came up to the tick in which the link is found back may be as old as the outage.
    assert robot.tick(3) == [STOP]
    assert robot.tick(4, 5) == [NOISY] * 2
    assert robot.journal.events[-1] == (3, "the link is back")
    assert robot.runtime.link_losses == 1


def test_a_link_lost_and_back_between_two_ticks_is_a_loss():
    robot = Robot()
    robot.link.up_since_s = 0.0
    robot.tick(0, 1)
    before = robot.runtime.link_losses
    robot.link.up_since_s, robot.link.fault = 0.03, "noise on the line"
    assert robot.tick(2, 3) == [STOP, NOISY]
    assert robot.runtime.link_losses == before + 1
    assert robot.journal.events[-2:] == [(2, "the link was lost: noise on the line"), (2, "the link is back")]


def test_a_link_that_stays_up_is_not_talked_of():
    robot = Robot()
    robot.tick(*range(10))
    assert robot.journal.events == []
    assert robot.runtime.link_losses == 0
    assert robot.link.up_since_s == -math.inf


def test_a_command_that_never_left_is_marked_and_no_other():
    robot = Robot()
    robot.link.dropped = 0
    robot.tick(0)
    robot.link.dropped = 1
    robot.tick(1, 2)
    robot.link.dropped = 3
    robot.tick(3, 4)
    assert [bool(flags & UNSENT) for flags in robot.flags()] == [False, True, False, True, False]


def test_the_operator_s_stop_is_noted_once():
    robot = Robot()
    robot.tick(0)
    robot.source.stop()
    assert robot.tick(1, 2, 3) == [STOP] * 3
    assert robot.journal.events == [(1, "the operator said stop")]
    assert robot.flags()[1:] == [STOPPED] * 3


def test_a_link_that_fails_is_noted_before_the_run_ends():
    robot = Robot()
    robot.tick(0)
    robot.link.fault = "broken"
    with pytest.raises(MtmError, match="cable pulled"):
        robot.tick(1)
    assert robot.journal.events == [(1, "the link failed: cable pulled")]
    assert robot.runtime.link_losses == 1
