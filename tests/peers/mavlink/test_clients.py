"""Other people's ground stations and libraries, with our simulated vehicles and our program."""

import json
import shutil
import signal
import socket
import sys
import time
from contextlib import closing

import numpy as np
import pytest

from hil.vehicles.mavlink_firmware import COPTER, PX4
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from mtm_onboard.journal.journal import read_journal
from mtm_onboard.links.mavlink_ports import UdpPort
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Key, load_key, save_key
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.guard import NOISE
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.schemes import FAKE_SECRET, small_scheme
from tests.peers.conftest import PEERS, ROOT, installed, polled, until

pytestmark = pytest.mark.peer

HERE = ROOT / "tests/peers/mavlink"
FAKE_KEY = b"not a real secret, only for test"
CONFIG = """
[robot]
name = "r"
channel = "a"
[transport]
kind = "mavlink"
profile = "copter"
endpoint = "udpout:127.0.0.1:{port}"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
socket = "{folder}/r.base"
[journal]
path = "{folder}/r.csv"
"""


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_signed_client_drives_and_an_unsigned_one_does_not(start):
    if shutil.which("node") is None:
        pytest.skip("Node.js is not here")
    modules = installed("node", "node_modules")
    plant, port = FloatingPlant(), UdpPort(listen=("127.0.0.1", 0))
    vehicle = MavlinkVehicle(COPTER, plant, port, is_guided=True, is_armed=True, signing_key=FAKE_KEY)
    with closing(port), polled(vehicle.poll):
        client = start("node", HERE / "signed_client.js", modules, port.number, FAKE_KEY.hex())
        assert until(lambda: vehicle.refused_frames >= 40, 20.0), client.output
        assert vehicle.setpoints == 0
        assert plant.velocity_body == STOP
        assert until(lambda: vehicle.setpoints >= 100, 20.0), client.output
        # In the body's frame of REP-103, where right is negative.
        assert plant.velocity_body == BodyVelocity(0.5, -0.25, 0.0)
        heard = [json.loads(client.wait_for('"system"')) for _ in range(1)]
        assert heard[0] == {"system": 1, "signature": "right"}
        refused = vehicle.refused_frames
        assert until(lambda: vehicle.setpoints >= 200, 20.0)
        assert vehicle.refused_frames == refused


def test_our_program_drives_a_vehicle_through_a_router(start, tmp_path):
    router_port, our_port = free_port(), free_port()
    installed("mavlink")
    proxy = PEERS / "mavlink/bin/mavproxy.py"
    plant, port = FloatingPlant(), UdpPort(peer=("127.0.0.1", router_port))
    vehicle = MavlinkVehicle(COPTER, plant, port, is_guided=True, is_armed=True)
    save_key(Key("fake-key", FAKE_SECRET, small_scheme()), tmp_path / "r.key")
    (tmp_path / "robot.toml").write_text(CONFIG.format(port=our_port, folder=tmp_path))
    with closing(port), polled(vehicle.poll):
        router = start(
            PEERS / "mavlink/bin/python", proxy, f"--master=udpin:127.0.0.1:{router_port}",
            f"--out=udpin:127.0.0.1:{our_port}", "--non-interactive", f"--state-basedir={tmp_path}", HOME=str(tmp_path),
        )  # fmt: skip
        assert until(lambda: "online system 1" in router.output or "Detected vehicle 1" in router.output, 40.0), (
            router.output
        )
        options = ("--config", tmp_path / "robot.toml", "--key", tmp_path / "r.key", "--message", 7)
        run = start(sys.executable, "-m", "mtm_onboard", "run", *options)
        run.wait_for("the link is up", 40.0)
        client = BaseCommandClient(tmp_path / "r.base")
        for _ in range(250):
            client.send(BodyVelocity(0.3, 0.0, 0.0))
            time.sleep(0.02)
        run.signal(signal.SIGINT)
        assert run.end() == 0, run.output
        client.close()
        record = with_noise(read_journal(tmp_path / "r.csv"), load_key(tmp_path / "r.key"))
        assert np.count_nonzero(record.flags & NOISE) > 150
        obeyed = np.array([velocity for _, velocity in plant.commands])
        sent = record.sent[record.flags == NOISE]
        # What the vehicle obeyed is what was sent, in the wire's single precision, and in the end nothing.
        closest = np.min(np.linalg.norm(sent[-100:, None] - obeyed[None], axis=2), axis=1)
        assert np.mean(closest < 1e-5) > 0.95
        assert until(lambda: plant.velocity_body == STOP, 5.0)


def test_mavsdk_arms_a_vehicle_and_drives_it_offboard(start):
    python = installed("mavlink")
    client_port = free_port()
    plant, port = FloatingPlant(), UdpPort(peer=("127.0.0.1", client_port))
    vehicle = MavlinkVehicle(PX4, plant, port)
    with closing(port), polled(vehicle.poll):
        client = start(python, HERE / "offboard.py", client_port, free_port(socket.SOCK_STREAM))
        client.wait_for("offboard", 60.0)
        assert until(lambda: plant.velocity_body != STOP, 5.0), client.output
        forward, left, turn = plant.velocity_body
        assert (forward, left) == pytest.approx((0.5, -0.25))
        assert turn == pytest.approx(-np.radians(10.0), abs=1e-5)
        client.wait_for("ended")
        assert client.end() == 0, client.output
        assert until(lambda: plant.velocity_body == STOP, 5.0)
