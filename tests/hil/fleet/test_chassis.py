import pytest

from hil.fleet.chassis import chassis_of
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError


def place_after_a_second(seed):
    robot = chassis_of("create")(seed, (1.0, 2.0))
    robot.command(0.0, BodyVelocity(0.5, 0.0, 0.0))
    robot.step(1.0)
    return robot.position_xy_m


def test_a_seed_draws_one_robot_of_the_kind():
    assert place_after_a_second(3) == place_after_a_second(3) != place_after_a_second(4)
    x_m, y_m = place_after_a_second(3)
    assert 1.1 < x_m < 1.5
    assert y_m == pytest.approx(2.0, abs=0.05)


def test_the_calibrated_chassis_is_the_rig_s_own():
    assert chassis_of("robomaster") is None


def test_a_kind_that_is_not_known_is_refused():
    with pytest.raises(MtmError, match="there is no plant 'boat'"):
        chassis_of("boat")
