import numpy as np
import pytest

from hil.plants.family import PLANTS
from hil.plants.robots import STEP_S, SteppedRobot, driven, path
from mtm_onboard.model.velocity import BodyVelocity


def test_a_body_that_turns_once_while_it_drives_comes_back():
    poses = path(np.tile([0.5, 0.0, 2 * np.pi], (100, 1)), STEP_S)
    assert poses[-1] == pytest.approx([0.0, 0.0, 2 * np.pi], abs=1e-9)
    assert poses[49, :2] == pytest.approx([0.0, 0.5 / np.pi], abs=1e-3)


def test_a_step_to_the_left_of_a_turned_body_goes_backwards():
    velocities = np.zeros((200, 3))
    velocities[:100, 2] = 0.5 * np.pi
    velocities[100:, 1] = 1.0
    assert path(velocities, STEP_S)[-1, :2] == pytest.approx([-1.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("name", list(PLANTS))
def test_step_by_step_a_robot_moves_as_over_the_whole_run(name):
    robot = PLANTS[name].draw(np.random.default_rng(2))
    demand = 0.3 * np.random.default_rng(3).standard_normal((500, 3))
    demand[:, 2] = 0.2
    stepped, poses = SteppedRobot(robot, 7), []
    for row, velocity in enumerate(demand.tolist()):
        stepped.command(row * STEP_S, BodyVelocity(*velocity))
        stepped.step((row + 1) * STEP_S)
        poses.append((*stepped.position_xy_m, stepped.heading_rad))
    assert np.array(poses) == pytest.approx(driven(robot, demand, np.random.default_rng(7)), abs=1e-9)


def test_it_starts_where_and_as_it_is_put():
    robot = PLANTS["robomaster"].draw(np.random.default_rng(2))
    stepped = SteppedRobot(robot, 7, (1.0, 2.0), np.pi / 2)
    stepped.command(0.0, BodyVelocity(0.5, 0.0, 0.0))
    stepped.step(2.0)
    (x_m, y_m), straight = stepped.position_xy_m, SteppedRobot(robot, 7)
    straight.command(0.0, BodyVelocity(0.5, 0.0, 0.0))
    straight.step(2.0)
    ahead_m, left_m = straight.position_xy_m
    assert (x_m, y_m) == pytest.approx((1.0 - left_m, 2.0 + ahead_m))
    assert stepped.velocity_body == straight.velocity_body


def test_a_differential_drive_does_not_go_sideways_on_demand():
    robot = PLANTS["diff-drive"].draw(np.random.default_rng(2))
    sideways = robot.respond(STEP_S).advance(np.tile([0.0, 0.5, 0.0], (100, 1)))
    assert np.all(sideways == 0.0)


def test_robots_of_a_kind_differ_and_repeat():
    demand = np.tile([0.5, 0.0, 0.0], (100, 1))

    def followed(name, seed):
        return PLANTS[name].draw(np.random.default_rng(seed)).respond(STEP_S).advance(demand)

    for name in PLANTS:
        assert np.array_equal(followed(name, 1), followed(name, 1))
        assert np.array_equal(followed(name, 1), followed(name, 2)) == (name == "robomaster")
