"""The C shim in the place of the Python modulator: the same message to within the image's resolution."""

import numpy as np
import pytest

from hil.vehicles.shim_modulator import ShimModulator
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, MtmError, Scheme
from mtm_onboard.runtime.modulator import Modulator

SECRET = b"not a real secret, only for test"
BASE = BodyVelocity(0.3, -0.2, 0.1)


def codebook(schedule="fixed", axes=("vy", "vx")):
    channel = Channel("robot", "robot", axes, 3, 0.1)
    return Codebook(
        SECRET,
        Scheme(
            name="test",
            rate_hz=50.0,
            band_hz=(0.5, 5.0),
            alphabet_size=4,
            message_ticks=150,
            channels=(channel,),
            schedule=schedule,
        ),
    )


def both(schedule, **options):
    return [kind(codebook(schedule), "robot", (1, 2, 3), **options) for kind in (Modulator, ShimModulator)]


def difference(python, shim, ticks):
    worst = 0.0
    for tick in ticks:
        worst = max(worst, float(np.max(np.abs(np.subtract(python.add(tick, BASE), shim.add(tick, BASE))))))
        for modulator in (python, shim):
            modulator.prepare(tick)
    return worst


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
@pytest.mark.parametrize("repeat", [True, False])
def test_every_command_agrees_with_the_python_modulator(schedule, repeat):
    assert 0 < difference(*both(schedule, repeat=repeat), range(500)) < 1e-5


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_missed_ticks_and_jumps_shift_nothing(schedule):
    ticks = [0, 3, 140, 149, 150, 151, 700, 701, 10, 11, 1_000_000, 1_000_149, 1_000_150]
    assert difference(*both(schedule), ticks) < 1e-5


def test_the_second_buffer_carries_a_rolling_message_on():
    _, shim = both("rolling")
    for tick in range(450):
        shim.add(tick, BASE)
        shim.prepare(tick)
    assert shim._shim.tick == 449


def test_perturbation_is_in_sigmas_in_the_channel_s_axis_order():
    python, shim = both("fixed")
    for tick in range(200):
        np.testing.assert_allclose(shim.perturbation(tick), python.perturbation(tick), atol=1e-4)
        np.testing.assert_allclose(
            shim.substitute(tick, np.zeros(2), 2.0), python.substitute(tick, np.zeros(2), 2.0), atol=2e-4
        )


def test_outside_the_message_the_command_is_left_alone():
    _, shim = both("fixed", repeat=False)
    assert shim.add(-1, BASE) is BASE
    assert shim.add(150, BASE) is BASE
    assert not shim.perturbation(150).any()
    assert (shim.sends(149), shim.sends(150)) == (True, False)


def test_axes_that_no_body_velocity_has_are_refused():
    with pytest.raises(MtmError, match="elbow"):
        ShimModulator(codebook(axes=("elbow",)), "robot", (1, 2, 3))
