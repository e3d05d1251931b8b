import numpy as np
import pytest

from hil.experiments.plants.genie import linear_taps
from hil.fleet.sending import STEP_S
from hil.plants.interference import Slip
from hil.plants.linear_response import LinearResponse
from hil.plants.responses import PerAxis, Saturation
from hil.plants.robots import Robot
from hil.worlds.vehicles import VEHICLES

BAND_HZ = (0.5, 5.0)


def taps_of(respond, name="quadrotor", sigma=0.1):
    robot = Robot(respond, lambda step_s, draw: Slip(step_s, (0.0, 0.0, 0.0), 0.1, draw))
    return linear_taps(VEHICLES[name], robot, sigma, BAND_HZ, np.random.default_rng(1))


def gain_at(tap, frequency_hz):
    return np.abs(np.sum(tap * np.exp(-2j * np.pi * frequency_hz * STEP_S * np.arange(len(tap)))))


@pytest.mark.parametrize("frequency_hz", [0.6, 1.5, 4.0])
def test_the_response_of_a_linear_robot_is_found(frequency_hz):
    response = LinearResponse(gain=0.9, delay_s=0.1, natural_hz=1.5, damping=0.4)
    taps = taps_of(lambda step_s: PerAxis([response.respond(step_s) for _ in range(3)]))
    assert gain_at(taps[0, 0], frequency_hz) == pytest.approx(abs(response.at([frequency_hz])[0]), rel=0.02)
    assert gain_at(taps[1, 0], frequency_hz) < 0.01


def test_a_gain_that_bends_is_smaller_on_the_average():
    taps = taps_of(lambda _step_s: Saturation(0.2))
    assert 0.1 < gain_at(taps[0, 0], 1.0) < 0.8
