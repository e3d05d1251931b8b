import pytest

from hil.experiments.detectors.accuracy_rollout import WHOLE
from hil.experiments.worlds.accuracy import read_world, world_parameters, world_scheme
from hil.experiments.worlds.accuracy_table import WORLDS
from mtm_onboard.protocol import MtmError


def test_long_windows_of_the_lander_are_read_right():
    scheme = world_scheme("lunar-lander", 4, 150, 2)
    right = read_world(world_parameters("lunar-lander", scheme, "matched"), 1)
    assert right == {"side": 2, "main": 2, "side+main": 2, WHOLE: 1}


def test_the_inner_joint_is_read_while_the_outer_one_speaks():
    right = read_world(world_parameters("reacher", world_scheme("reacher", 4, 150, 2), "matched"), 1)
    assert right["inner"] == 2


def test_every_world_can_be_swept():
    assert list(WORLDS) == ["robomaster", "discovery", "lunar-lander", "reacher", "football"]


def test_a_scheme_for_another_world_is_refused():
    with pytest.raises(MtmError, match=r"reacher has no axis 'lander.vx'; its axes are: arm.inner, arm.outer"):
        world_parameters("reacher", world_scheme("lunar-lander", 4, 100, 1), "matched")


def test_a_detector_that_does_not_exist_is_refused():
    with pytest.raises(MtmError, match="no detector 'ear'"):
        world_parameters("reacher", world_scheme("reacher", 4, 100, 1), "ear")
