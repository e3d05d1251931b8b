"""Libraries for real RoboMasters drive the simulated one over its plaintext SDK."""

import json
from contextlib import ExitStack

import pytest

from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import TcpPort
from mtm_onboard.model.velocity import STOP
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.plaintext_rig import free_udp_port
from tests.peers.conftest import ROOT, installed, polled

pytestmark = pytest.mark.peer


@pytest.mark.parametrize("library", ["robomasterpy", "sbhs_robomaster"])
def test_a_library_for_real_robots_drives_the_simulated_one(start, library):
    plant, port = FloatingPlant(), TcpPort(push_port=free_udp_port())
    node = PlaintextMotionController(MotionController(plant, deadman_s=None), [port])
    with ExitStack() as ending:
        ending.callback(node.shutdown)
        ending.enter_context(polled(node.poll))
        script = ROOT / "tests/peers/robomaster/plain_client.py"
        client = start(installed("robomaster"), script, library, port.port, port._push_port)
        assert client.end(60.0) == 0, client.output
    told: dict[str, object] = {}
    for line in client.lines:
        told |= json.loads(line) if line.startswith("{") else {}
    forward, right, clockwise = told["speed"]
    assert (forward, right) == pytest.approx((0.5, 0.25))
    assert clockwise == pytest.approx(30.0, abs=0.1)
    assert told["yaw"] > 0.0
    driven = [velocity for _, velocity in plant.commands if velocity != STOP]
    assert driven[0][:2] == pytest.approx((0.5, -0.25))
    assert driven[0][2] == pytest.approx(-0.5236, abs=1e-3)
    assert plant.velocity_body == STOP
