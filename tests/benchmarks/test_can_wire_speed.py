"""Time of one robot's CAN wire, both ends, for 20 ms of simulated time; `make bench` shows it.

The simulation of four robots runs five times faster than real time while this stays well below 1 ms.
"""

from hil.robots.direct import DirectTransport
from hil.robots.motion_controller import MotionController
from mtm_onboard.clock import SystemClock
from mtm_onboard.motion import BodyVelocity
from tests.hil.robots.floating_plant import FloatingPlant
from tests.onboard.transports.can_rig import CanRig

COMMAND = BodyVelocity(0.1, 0.2, 0.3)


def test_a_command_two_heartbeats_and_a_push_take_well_under_a_millisecond(benchmark):
    rig = CanRig("robomaster-benchmark")
    rig.tap.shutdown()

    def tick() -> None:
        rig.transport.send(COMMAND)
        rig.run(0.02)

    with rig.transport:
        benchmark(tick)
        assert rig.transport.telemetry is not None
    rig.node.shutdown()


def test_a_command_without_a_wire_takes_a_few_microseconds(benchmark):
    controller = MotionController(FloatingPlant())
    with DirectTransport(controller, SystemClock()) as link:
        benchmark(link.send, COMMAND)
        assert controller.demand != (0.0, 0.0, 0.0)
