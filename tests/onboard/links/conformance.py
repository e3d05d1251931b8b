"""What every transport must do, proven by the plant at its far end. A test class inherits it and overrides `rig`."""

import math
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from statistics import median

import pytest

from hil.fleet.clock import SimulatedClock
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.links.base import Link
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.ending_signals import ending_signals
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.driven import Driven


@dataclass
class Rig:
    """A transport and its robot on one simulated clock; `wire_bytes` counts what has left the transport so far.

    What a wire can suffer is optional, and tests that need what a rig lacks are skipped: `refuse(n)` has it refuse the
    next n writes, `clog()` has it take nothing from now on, `cut()` and `mend()` break it and put it right. `remake()`
    gives another transport to the same robot, which is not served by the clock yet.
    """

    transport: Link
    controller: MotionController
    plant: FloatingPlant
    clock: SimulatedClock
    wire_bytes: Callable[[], int]
    refuse: Callable[[int], None] | None = field(default=None, kw_only=True)
    clog: Callable[[], None] | None = field(default=None, kw_only=True)
    cut: Callable[[], None] | None = field(default=None, kw_only=True)
    mend: Callable[[], None] | None = field(default=None, kw_only=True)
    remake: Callable[[], Link] | None = field(default=None, kw_only=True)

    def needs(self, *names):
        for name in names:
            if getattr(self, name) is None:
                pytest.skip(f"this rig has no {name}")

    def drive(self, velocity, seconds=0.5):
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s - 1e-9:
            self.transport.send(velocity)
            self.clock.sleep_until(self.clock.now() + 0.02)

    def settle(self):
        self.clock.sleep_until(self.clock.now() + 0.05)

    def is_engaged(self):
        """Whether the robot obeys velocities."""
        return self.controller.work_mode

    def is_released(self):
        """Whether the robot was told to stand still; a robot whose link cannot disengage it overrides this."""
        return not self.controller.work_mode


class LinkConformance:
    # Two velocities that the robot can have and that have little in common; others may be set for a robot's sake.
    askew = BodyVelocity(0.5, 0.2, 0.3)
    other = BodyVelocity(0.0, 0.5, 0.0)

    @pytest.fixture
    def rig(self):
        """A `Rig` whose robot has no deadman, so that only the transport can stop it."""
        raise NotImplementedError

    def test_positive_vx_drives_forward(self, rig):
        with rig.transport:
            rig.drive(BodyVelocity(0.5, 0.0, 0.0))
        x_m, y_m = rig.plant.position_xy_m
        assert x_m == pytest.approx(0.25, abs=0.02)
        assert (y_m, rig.plant.heading_rad) == pytest.approx((0.0, 0.0), abs=1e-9)

    def test_positive_vy_drives_to_the_left(self, rig):
        with rig.transport:
            rig.drive(BodyVelocity(0.0, 0.5, 0.0))
        x_m, y_m = rig.plant.position_xy_m
        assert y_m == pytest.approx(0.25, abs=0.02)
        assert (x_m, rig.plant.heading_rad) == pytest.approx((0.0, 0.0), abs=1e-9)

    def test_positive_wz_turns_counter_clockwise(self, rig):
        with rig.transport:
            rig.drive(BodyVelocity(0.0, 0.0, 1.0))
        assert rig.plant.heading_rad == pytest.approx(0.5, abs=0.04)
        assert rig.plant.position_xy_m == (0.0, 0.0)

    def test_opening_alone_moves_nothing(self, rig):
        with rig.transport:
            rig.settle()
            assert rig.is_engaged()
        assert rig.plant.position_xy_m == (0.0, 0.0)

    def test_leaving_stops_the_robot(self, rig):
        with rig.transport:
            rig.drive(self.askew)
            assert rig.plant.velocity_body != STOP
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()

    def test_an_exception_stops_the_robot_and_comes_through(self, rig):
        def fail_while_driving():
            with rig.transport:
                rig.drive(BodyVelocity(0.5, 0.0, 0.0))
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            fail_while_driving()
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()

    def test_stop_and_close_may_be_called_again_and_again(self, rig):
        rig.transport.open()
        rig.drive(BodyVelocity(0.5, 0.0, 0.0))
        for _ in range(3):
            rig.transport.stop()
        for _ in range(3):
            rig.transport.close()
        rig.transport.stop()
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()

    def test_a_link_that_was_never_opened_can_be_stopped_and_closed(self, rig):
        rig.transport.stop()
        rig.transport.close()
        assert rig.wire_bytes() == 0

    @pytest.mark.parametrize("axis", range(3))
    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    def test_a_velocity_that_is_not_finite_never_reaches_the_wire(self, rig, axis, bad):
        values = [0.1, 0.1, 0.1]
        values[axis] = bad
        with rig.transport:
            before = rig.wire_bytes()
            with pytest.raises(ValueError, match="not finite"):
                rig.transport.send(BodyVelocity(*values))
            assert rig.wire_bytes() == before
        rig.settle()
        assert all(velocity == STOP for _, velocity in rig.plant.commands)
        assert rig.controller.faults == 0

    def test_nothing_can_be_sent_before_open(self, rig):
        with pytest.raises(MtmError, match="not open"):
            rig.transport.send(BodyVelocity(0.1, 0.0, 0.0))
        assert rig.wire_bytes() == 0

    def test_nothing_can_be_sent_after_stop(self, rig):
        with rig.transport:
            rig.transport.stop()
            with pytest.raises(MtmError, match="open"):
                rig.transport.send(BodyVelocity(0.1, 0.0, 0.0))
        rig.settle()
        assert rig.plant.position_xy_m == (0.0, 0.0)

    def test_opening_after_a_stop_drives_again_but_does_not_resume(self, rig):
        with rig.transport:
            rig.drive(BodyVelocity(0.5, 0.0, 0.0))
            rig.transport.stop()
            rig.settle()
            rig.transport.open()
            rig.settle()
            assert rig.plant.velocity_body == STOP
            rig.drive(self.other)
            assert rig.plant.velocity_body == self.other

    def test_a_request_to_terminate_stops_the_robot(self, rig):
        with ending_signals() as asked_to_end, rig.transport:
            driven = Driven(rig.transport, rig.clock)
            driven.run(0.2, self.askew)
            assert rig.plant.velocity_body != STOP
            os.kill(os.getpid(), signal.SIGTERM)
            asked_s = rig.clock.now()
            driven.run(10.0, self.askew, stop=asked_to_end)
            assert rig.clock.now() - asked_s < 0.1
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()

    def test_a_far_deadman_outlives_the_commands_and_not_the_link(self, rig):
        rig.controller.deadman_s = 0.2
        with rig.transport:
            rig.drive(self.askew)
            rig.clock.sleep_until(rig.clock.now() + 0.3)
            assert rig.plant.velocity_body == STOP
            rig.drive(self.other)
            assert rig.plant.velocity_body == self.other

    @pytest.mark.parametrize("axis", range(3))
    @pytest.mark.parametrize("speed", [1e2, 1e4, 1e9, 1e30, 1e308])
    def test_a_velocity_out_of_range_is_refused_or_keeps_its_sign(self, rig, axis, speed):
        """Nothing wraps round on the way, and the link works as before."""
        values = [0.0, 0.0, 0.0]
        with rig.transport:
            for value in (speed, -speed):
                values[axis] = value
                with suppress(ValueError, MtmError):
                    rig.transport.send(BodyVelocity(*values))
                rig.clock.sleep_until(rig.clock.now() + 0.02)
                reached = rig.plant.velocity_body
                assert reached.is_finite()
                assert reached[axis] * value >= 0.0
                assert reached == STOP or [reached[other] for other in range(3) if other != axis] == [0.0, 0.0]
                rig.drive(STOP, 0.04)
            rig.drive(self.other)
            assert rig.plant.velocity_body == self.other
        assert rig.controller.faults == 0

    @pytest.mark.parametrize("writes", [1, 2, 3])
    def test_when_sending_fails_the_robot_is_stopped_all_the_same(self, rig, writes):
        rig.needs("refuse")

        def lose_a_write_while_driving():
            with rig.transport:
                Driven(rig.transport, rig.clock).run(0.2, self.askew)
                rig.refuse(writes)
                rig.transport.send(self.askew)

        with pytest.raises(MtmError):
            lose_a_write_while_driving()
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()

    def test_a_clogged_wire_holds_a_command_no_longer_than_the_bound(self, rig):
        rig.needs("clog")
        durations_s = []
        rig.transport.open()
        rig.clog()
        for _ in range(5):
            began_s = time.monotonic()
            with suppress(MtmError):
                rig.transport.send(self.askew)
            durations_s.append(time.monotonic() - began_s)
        # A busy host may hold up single ones.
        assert median(durations_s) <= rig.transport.write_bound_s + 0.01

    def test_a_link_that_is_back_obeys_only_commands_from_after(self, rig):
        rig.needs("cut", "mend", "remake")
        rig.controller.deadman_s = 0.2
        link = ReconnectingLink(rig.remake, rig.clock)
        rig.clock.every(link.service_period_s, link.service)
        with link:
            driven = Driven(link, rig.clock)
            driven.run(0.5, self.askew)
            assert rig.plant.velocity_body == pytest.approx(self.askew, abs=0.01)
            rig.cut()
            driven.run(1.0, self.askew)
            assert rig.plant.velocity_body == STOP
            assert (link.losses, link.up_since_s) == (1, None)
            rig.mend()
            driven.run(1.0)
            assert link.up_since_s is not None
            assert rig.is_engaged()
            assert rig.plant.velocity_body == STOP
            driven.run(0.2, self.other)
            assert rig.plant.velocity_body == self.other
        rig.settle()
        assert rig.plant.velocity_body == STOP
        assert rig.is_released()
