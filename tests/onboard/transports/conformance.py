"""What every transport must do, proven by the plant at its far end. A test class inherits it and overrides `rig`."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from hil.clock import SimulatedClock
from hil.robots.motion_controller import MotionController
from mtm_onboard.motion import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.transports.base import Transport
from tests.hil.robots.floating_plant import FloatingPlant


@dataclass
class Rig:
    """A transport and its robot on one simulated clock; `wire_bytes` counts what has left the transport so far."""

    transport: Transport
    controller: MotionController
    plant: FloatingPlant
    clock: SimulatedClock
    wire_bytes: Callable[[], int]

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


class TransportConformance:
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

    def test_opening_again_after_a_stop_drives_again_but_does_not_resume(self, rig):
        with rig.transport:
            rig.drive(BodyVelocity(0.5, 0.0, 0.0))
            rig.transport.stop()
            rig.settle()
            rig.transport.open()
            rig.settle()
            assert rig.plant.velocity_body == STOP
            rig.drive(self.other)
            assert rig.plant.velocity_body == self.other
