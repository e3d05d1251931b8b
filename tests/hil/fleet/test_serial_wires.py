import time
import tomllib

import pytest

from hil.fleet.clock import AnsweringClock, SimulatedClock
from hil.fleet.serial_wires import serial_wire
from hil.vehicles.motion_controller import DEADMAN_S
from mtm_onboard.links.factory import make_link
from mtm_onboard.model.velocity import BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.patience import PATIENCE_S


@pytest.mark.parametrize(
    ("wire", "kind", "deadman_s"),
    [("can", "robomaster-can", DEADMAN_S), ("plaintext", "robomaster-uart", None)],
)
def test_its_transport_fields_reach_the_robot_behind_it(wire, kind, deadman_s):
    plant = FloatingPlant()
    serial = serial_wire(wire, plant)
    options = tomllib.loads(serial.transport)
    assert options.pop("kind") == kind
    assert serial.controller.deadman_s == deadman_s
    deadline_s = time.monotonic() + PATIENCE_S
    try:
        # A link that waits for the robot does so by this clock, and the robot answers meanwhile.
        clock = {"clock": AnsweringClock(SimulatedClock(), serial.poll)} if wire == "can" else {}
        with make_link(kind, options | clock) as transport:
            transport.send(BodyVelocity(0.5, 0.0, 0.0))
            while plant.velocity_body != BodyVelocity(0.5, 0.0, 0.0):
                assert time.monotonic() < deadline_s
                serial.poll(0.01)
        while serial.controller.work_mode:
            assert time.monotonic() < deadline_s
            serial.poll(0.02)
        assert serial.faults() == 0
    finally:
        serial.shutdown()
