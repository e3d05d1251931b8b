from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.task.drive import CLEAN, KEYED, SAME_BAND, WHITE, course, distances_m, drive
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Channel, MtmError

SCHEME = fleet_scheme()


@pytest.fixture(scope="module")
def drives():
    return {condition: drive(SCHEME, condition, 5) for condition in (CLEAN, WHITE, SAME_BAND, KEYED)}


def test_distances_are_those_of_the_nearest_part_of_the_route():
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    places = np.array([[1.0, 0.5], [3.0, 0.5], [-3.0, 4.0], [2.0, 0.25]])
    assert distances_m(places, corners) == pytest.approx([0.5, 1.0, 5.0, 0.0])


def test_a_robot_arrives_under_every_noise(drives):
    for driven in drives.values():
        assert 25.0 < driven.time_s < 45.0
        assert 0.0 < driven.path_error_m < 0.2


def test_noise_adds_its_power_to_the_energy(drives):
    added = [drives[condition].energy_m2ps2 - drives[CLEAN].energy_m2ps2 for condition in (WHITE, SAME_BAND, KEYED)]
    assert added == pytest.approx([0.02] * 3, abs=0.006)


def test_noise_of_a_band_jerks_less_than_white_noise(drives):
    # The controller's own, at the corners, is there as well.
    white, *others = (drives[name].jerk_mps3 ** 2 - drives[CLEAN].jerk_mps3 ** 2 for name in (WHITE, SAME_BAND, KEYED))
    assert all(0.0 < other < 0.02 * white for other in others)


def test_a_drive_is_the_same_for_the_same_seed(drives):
    assert drive(SCHEME, KEYED, 5) == drives[KEYED]
    assert drive(SCHEME, KEYED, 6) != drives[KEYED]


def test_noise_of_the_band_has_the_scheme_s_spectrum():
    loud = tuple(replace(channel, sigma=3.0) for channel in SCHEME.channels)
    sloped = replace(SCHEME, channels=loud, spectrum=((0.5, 0.0), (5.0, -20.0)))
    commands = course(sloped, SAME_BAND, 5, longest_s=24.0).commands[:, 1]
    power = np.abs(np.fft.rfft(commands * np.hanning(len(commands)))) ** 2
    hz = np.fft.rfftfreq(len(commands), 0.02)
    low, high, beyond = (
        power[(hz > first) & (hz < last)].mean() for first, last in ((0.6, 1.5), (4.0, 4.9), (6.0, 9.0))
    )
    assert low > 10.0 * high > 100.0 * beyond
    assert commands.std() == pytest.approx(3.0, rel=0.1)


def test_another_robot_drives_its_own_task():
    driven = course(SCHEME, CLEAN, 5, "create", 5.0)
    assert (len(driven.poses), len(driven.commands)) == (251, 250)
    assert np.all(driven.commands[:, 1] == 0.0)
    assert np.abs(driven.poses[-1] - driven.poses[0]).min() > 0.2


def test_all_channels_of_a_body_are_driven_with():
    turning = replace(SCHEME, channels=(*SCHEME.channels, Channel("turn", "robot0", ("wz",), 1, 0.5)))
    for condition in (WHITE, SAME_BAND, KEYED):
        plain, turned = (drive(scheme, condition, 5).heading_error_deg for scheme in (SCHEME, turning))
        assert turned > plain + 0.2


def test_a_joint_s_noise_drives_no_robot():
    scheme = replace(SCHEME, channels=(Channel("arm", "arm", ("joint1",), 1, 0.1),))
    with pytest.raises(MtmError, match="can be added to a body velocity"):
        drive(scheme, KEYED, 5)
