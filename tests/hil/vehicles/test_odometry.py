import math

import pytest

from hil.vehicles.odometry import Odometry, turned
from mtm_onboard.model.velocity import BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant


def test_a_pose_counts_from_where_and_how_the_robot_stood():
    plant = FloatingPlant()
    plant.command(0.0, BodyVelocity(1.0, 0.0, math.pi / 2))
    plant.step(1.0)
    odometry = Odometry(plant)
    assert (odometry.position_xy_m, odometry.heading_rad) == ((0.0, 0.0), 0.0)
    plant.command(1.0, BodyVelocity(0.0, 2.0, 0.0))
    plant.step(2.0)
    assert odometry.position_xy_m == pytest.approx((0.0, 2.0))
    assert odometry.heading_rad == 0.0


def test_a_heading_stays_within_half_a_turn():
    plant = FloatingPlant()
    odometry = Odometry(plant)
    plant.command(0.0, BodyVelocity(0.0, 0.0, 4.0))
    plant.step(1.0)
    assert odometry.heading_rad == pytest.approx(4.0 - math.tau)


def test_a_quarter_turn_takes_x_to_y():
    assert turned(1.0, 0.0, math.pi / 2) == pytest.approx((0.0, 1.0))
