import math
import random

import pytest

from hil.fleet.clock import SimulatedClock
from hil.fleet.direct import DirectLink
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.model.velocity import BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.can_rig import LineRig, VirtualRig, can_rig
from tests.onboard.links.conformance import LinkConformance, Rig


def direct_rig(deadman_s=None, poll_s=0.010):
    clock = SimulatedClock()
    plant = FloatingPlant()
    controller = MotionController(plant, deadman_s)
    clock.every(poll_s, controller.advance)
    return Rig(DirectLink(controller, clock), controller, plant, clock, lambda: 0)


class TestDirectLinkConforms(LinkConformance):
    @pytest.fixture
    def rig(self):
        return direct_rig()


def motion(rig, ticks=200):
    """Poses after each tick of a drive with noise; the twentieth second tick is sent late, between two polls."""
    generator = random.Random(1)
    poses = []
    with rig.transport:
        for tick in range(ticks):
            rig.clock.sleep_until(0.02 * tick + (0.0037 if tick % 20 == 0 else 0.0))
            rig.transport.send(BodyVelocity(*(generator.gauss(0.0, 0.3) for _ in range(3))))
            poses.append((rig.plant.position_xy_m, rig.plant.heading_rad))
    rig.clock.sleep_until(0.02 * ticks + 0.1)
    return poses, rig.plant.position_xy_m, rig.plant.commands


@pytest.mark.parametrize("kind", [VirtualRig, LineRig])
@pytest.mark.parametrize("poll_s", [0.001, 0.010])
def test_the_motion_is_that_of_the_can_bus_bit_for_bit(kind, poll_s):
    with can_rig(kind, deadman_s=0.2, poll_s=poll_s) as over_can:
        expected = motion(over_can)
    assert motion(direct_rig(0.2, poll_s)) == expected
    assert expected[0][-1] != ((0.0, 0.0), 0.0)


def test_a_command_arrives_as_32_bit_floats_in_the_robots_units():
    rig = direct_rig()
    with rig.transport:
        rig.transport.send(BodyVelocity(0.1, 0.0, 0.1))
        rig.settle()
        arrived = rig.controller.demand
    assert arrived.vx_mps == 0.10000000149011612
    assert arrived.wz_radps != 0.1
    assert arrived.wz_radps == pytest.approx(math.radians(5.729578), rel=1e-7)
