"""Time of one robot's CAN wire, both ends, for 20 ms of simulated time; `make bench` shows it.

The simulation of four robots runs five times faster than real time while this stays well below 1 ms.
"""

import pytest

from hil.fleet.direct import DirectLink
from hil.vehicles.motion_controller import MotionController
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.model.velocity import BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.can_rig import LineRig, VirtualRig, can_rig

COMMAND = BodyVelocity(0.1, 0.2, 0.3)


@pytest.mark.parametrize("kind", [VirtualRig, LineRig])
def test_a_tick_on_the_wire_takes_well_under_a_millisecond(benchmark, kind):
    with can_rig(kind) as rig, rig.transport:
        if kind is VirtualRig:
            rig.tap.shutdown()

        def tick() -> None:
            rig.transport.send(COMMAND)
            rig.run(0.02)

        benchmark(tick)
        rig.run(0.02)
        assert rig.transport.telemetry is not None


def test_a_command_without_a_wire_takes_a_few_microseconds(benchmark):
    controller = MotionController(FloatingPlant())
    with DirectLink(controller, SystemClock()) as link:
        benchmark(link.send, COMMAND)
        assert controller.demand != (0.0, 0.0, 0.0)
