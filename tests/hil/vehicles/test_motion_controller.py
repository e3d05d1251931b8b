import math

import pytest

from hil.vehicles.motion_controller import MotionController
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant


def engaged(deadman_s: float | None = 0.2) -> tuple[MotionController, FloatingPlant]:
    plant = FloatingPlant()
    controller = MotionController(plant, deadman_s)
    controller.set_work_mode(True)
    return controller, plant


def test_a_command_reaches_the_plant_at_the_next_advance():
    controller, plant = engaged()
    controller.advance(0.0)
    controller.command_speed(0.004, 0.5, 0.0, 0.0)
    assert plant.velocity_body == STOP
    controller.advance(0.01)
    assert plant.commands[-1] == (0.01, BodyVelocity(0.5, 0.0, 0.0))


def test_the_plant_moves_under_the_command_that_was_in_force():
    controller, plant = engaged()
    controller.command_speed(0.0, 1.0, 0.0, 0.0)
    controller.advance(0.0)
    controller.command_speed(0.1, 0.0, 0.0, 0.0)
    controller.advance(0.1)
    controller.advance(0.2)
    assert plant.position_xy_m == pytest.approx((0.1, 0.0))


def test_a_stale_command_stops_the_robot_and_is_counted_once():
    controller, plant = engaged(deadman_s=0.2)
    controller.command_speed(0.0, 0.5, 0.0, 0.0)
    for now_ms in range(0, 200, 10):
        controller.advance(now_ms / 1000)
    assert plant.velocity_body == BodyVelocity(0.5, 0.0, 0.0)
    controller.advance(0.21)
    controller.advance(0.5)
    assert plant.velocity_body == STOP
    assert controller.deadman_stops == 1


def test_without_a_deadman_the_last_command_is_kept():
    controller, plant = engaged(deadman_s=None)
    controller.command_speed(0.0, 0.5, 0.0, 0.0)
    controller.advance(0.0)
    controller.advance(3600.0)
    assert plant.velocity_body == BodyVelocity(0.5, 0.0, 0.0)


def test_nothing_moves_while_the_work_mode_is_off():
    plant = FloatingPlant()
    controller = MotionController(plant)
    controller.command_speed(0.0, 0.5, 0.0, 0.0)
    controller.advance(0.0)
    assert plant.velocity_body == STOP
    assert controller.ignored_commands == 1


def test_switching_work_mode_off_and_on_does_not_resume():
    controller, plant = engaged(deadman_s=None)
    controller.command_speed(0.0, 0.5, 0.0, 0.0)
    controller.advance(0.0)
    controller.set_work_mode(False)
    controller.advance(0.01)
    assert plant.velocity_body == STOP
    controller.set_work_mode(True)
    controller.advance(0.02)
    assert plant.velocity_body == STOP


def test_switching_the_work_mode_on_twice_keeps_the_command():
    controller, plant = engaged()
    controller.command_speed(0.0, 0.5, 0.0, 0.0)
    controller.set_work_mode(True)
    controller.advance(0.0)
    assert plant.velocity_body == BodyVelocity(0.5, 0.0, 0.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_never_reaches_the_plant(bad):
    controller, plant = engaged()
    controller.command_speed(0.0, 0.0, bad, 0.0)
    controller.advance(0.0)
    assert controller.faults == 1
    assert all(velocity == STOP for _, velocity in plant.commands)
