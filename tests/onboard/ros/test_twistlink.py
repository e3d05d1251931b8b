"""Twists in and out in simulated time, with the runtime between them."""

import math

import numpy as np
import pytest

from hil.fleet.clock import SimulatedClock
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.ros.twist import set_velocity, velocity_of
from mtm_onboard.ros.twistlink import TwistLink
from mtm_onboard.runtime.modulator import Modulator
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.driven import Driven
from tests.onboard.links.conformance import LinkConformance, Rig
from tests.onboard.ros.twists import Twist, Vector3, twist
from tests.onboard.schemes import small_codebook


class TestTwistLinkConforms(LinkConformance):
    """The robot at the other end of the topic takes REP-103 twists."""

    @pytest.fixture
    def rig(self):
        clock, plant, published = SimulatedClock(), FloatingPlant(), []
        controller = MotionController(plant, deadman_s=None)
        controller.set_work_mode(True)

        def publish(message: Twist) -> None:
            published.append(message)
            controller.command_speed(clock.now(), message.linear.x, message.linear.y, message.angular.z)

        clock.every(0.001, controller.advance)
        return Topic(TwistLink(Twist, publish), controller, plant, clock, lambda: len(published))


class Topic(Rig):
    def is_released(self):
        """Nothing can be switched off over a topic."""
        return self.controller.demand == STOP


class Bench:
    """The runtime between two topics, on a simulated clock."""

    def __init__(self, modulator=None) -> None:
        self.published: list[Twist] = []
        link = TwistLink(Twist, self.published.append)
        link.open()
        self.driven = Driven(link, SimulatedClock(), modulator)

    def run(self, seconds: float, command: Twist | None = None) -> np.ndarray:
        """What is published meanwhile, rows of the six components, with `command` in each tick."""
        before = len(self.published)
        self.driven.run(seconds, None if command is None else velocity_of(command))
        return np.array([message.six() for message in self.published[before:]])


@pytest.mark.parametrize("speed", [0.4, -0.4])
@pytest.mark.parametrize(("axis", "component"), [(0, 0), (1, 1), (2, 5)])
def test_forward_left_and_counter_clockwise_are_so_on_both_sides(axis, component, speed):
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = speed
    rows = Bench().run(0.1, twist(*velocity))
    assert len(rows) == 5
    expected = np.zeros(6)
    expected[component] = speed
    assert np.array_equal(rows, np.tile(expected, (5, 1)))


def test_only_the_motion_in_the_plane_comes_through():
    climbing = Twist(Vector3(0.1, 0.2, 0.3), Vector3(0.4, 0.5, 0.6))
    assert velocity_of(climbing) == BodyVelocity(0.1, 0.2, 0.6)
    assert Bench().run(0.02, climbing).tolist() == [[0.1, 0.2, 0.0, 0.0, 0.0, 0.6]]


def test_a_twist_of_whole_numbers_becomes_one_of_floats():
    out = Twist()
    set_velocity(out, velocity_of(twist(1, 0, -1)))
    assert [type(value) for value in (out.linear.x, out.linear.y, out.angular.z)] == [float] * 3


def test_the_message_is_added_to_the_twists():
    modulator = Modulator(small_codebook(), "a", (1,))
    rows = Bench(Modulator(small_codebook(), "a", (1,))).run(2.4, twist(0.3, 0.1, 0.5))
    noise = np.array([modulator.perturbation(tick) for tick in range(120)])
    calm = np.all(np.abs(noise) < 4.0, axis=1)
    assert rows[calm][:, :2] == pytest.approx((np.array([0.3, 0.1]) + 0.1 * noise)[calm])
    assert np.all(rows[:, 5] == 0.5)


def test_a_stale_twist_loses_its_noise_first_and_then_its_motion():
    bench = Bench(Modulator(small_codebook(), "a", (1,)))
    bench.run(0.5, twist(0.3, 0.0, 0.0))
    rows = bench.run(1.0)
    # Noise for a tenth of a second, the base command's own direction up to a quarter, then nothing.
    assert rows[:4, 1].all()
    assert not rows[6:, 1].any()
    assert np.all(np.diff(rows[5:13, 0]) <= 0.0)
    assert not rows[13:].any()
    assert bench.run(0.1, twist(0.3, 0.0, 0.0))[:, 0].all()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_a_twist_that_is_not_finite_is_refused(bad, place):
    bench = Bench()
    bench.run(0.2, twist(0.3, 0.0, 0.2))
    values = [0.3, 0.0, 0.2]
    values[place] = bad
    rows = bench.run(0.5, twist(*values))
    assert np.all(np.isfinite(rows))
    assert rows[0].tolist() == [0.3, 0.0, 0.0, 0.0, 0.0, 0.2]
    assert not rows[13:].any()
    assert bench.driven.guard.refused == 25


def test_after_the_operator_s_stop_no_twist_moves_the_robot():
    bench = Bench(Modulator(small_codebook(), "a", (1,)))
    bench.run(0.2, twist(0.3, 0.0, 0.2))
    bench.driven.source.stop()
    assert not bench.run(0.5, twist(0.3, 0.0, 0.2)).any()
