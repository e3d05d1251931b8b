from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.task.drive import course, distances_m, drive
from hil.experiments.task.noise import CLEAN, KEYED, SAME_BAND, SAME_LAW, WHITE
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Channel, MtmError

SCHEME = fleet_scheme()
NOISES = (WHITE, SAME_BAND, SAME_LAW, KEYED)


@pytest.fixture(scope="module")
def drives():
    return {condition: drive(SCHEME, condition, 5) for condition in (CLEAN, *NOISES)}


def test_distances_are_those_of_the_nearest_part_of_the_route():
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    places = np.array([[1.0, 0.5], [3.0, 0.5], [-3.0, 4.0], [2.0, 0.25]])
    assert distances_m(places, corners) == pytest.approx([0.5, 1.0, 5.0, 0.0])


def test_a_robot_arrives_under_every_noise(drives):
    for driven in drives.values():
        assert 25.0 < driven.time_s < 45.0
        assert 0.0 < driven.path_error_m < 0.2


def test_noise_adds_its_power_to_the_energy(drives):
    added = [
        drives[condition].energy_m2ps2 - drives[CLEAN].energy_m2ps2 for condition in (WHITE, SAME_BAND, SAME_LAW, KEYED)
    ]
    assert added == pytest.approx([0.02] * 4, abs=0.006)


def test_noise_of_a_band_jerks_less_than_white_noise(drives):
    # The controller's own, at the corners, is there as well.
    white, *others = (
        drives[name].jerk_mps3 ** 2 - drives[CLEAN].jerk_mps3 ** 2 for name in (WHITE, SAME_BAND, SAME_LAW, KEYED)
    )
    assert all(0.0 < other < 0.02 * white for other in others)


def test_a_drive_is_the_same_for_the_same_seed(drives):
    assert drive(SCHEME, KEYED, 5) == drives[KEYED]
    assert drive(SCHEME, KEYED, 6) != drives[KEYED]


def test_another_robot_drives_its_own_task():
    driven = course(SCHEME, CLEAN, 5, "create", 5.0)
    assert (len(driven.poses), len(driven.commands)) == (251, 250)
    assert np.all(driven.commands[:, 1] == 0.0)
    assert np.abs(driven.poses[-1] - driven.poses[0]).min() > 0.2


def test_all_channels_of_a_body_are_driven_with():
    turning = replace(SCHEME, channels=(*SCHEME.channels, Channel("turn", "robot0", ("wz",), 1, 0.5)))
    for condition in NOISES:
        plain, turned = (drive(scheme, condition, 5).heading_error_deg for scheme in (SCHEME, turning))
        assert turned > plain + 0.2


@pytest.mark.parametrize("condition", NOISES)
def test_a_joint_s_noise_drives_no_robot(condition):
    scheme = replace(SCHEME, channels=(Channel("arm", "arm", ("joint1",), 1, 0.1),))
    with pytest.raises(MtmError, match="can be added to a body velocity"):
        drive(scheme, condition, 5)
