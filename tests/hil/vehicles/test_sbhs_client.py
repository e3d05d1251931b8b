"""An independent client of the plaintext protocol, written for real robots, meets the simulated one.

It speaks to fixed ports. Free ones take their place here, since whoever else uses this machine may have those.
"""

import asyncio
import gc
from contextlib import asynccontextmanager, suppress

import pytest
from sbhs_robomaster import Frequency, client, connect_to_robomaster

from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import TcpPort
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.plaintext_rig import free_udp_port
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(autouse=True)
def _collected():
    """The client leaves its telemetry socket to the garbage collector, which should not meet it in a later test."""
    yield
    gc.collect()


class Served:
    """A robot whose time goes 10 ms on whenever the event loop comes round."""

    def __init__(self, push_port):
        self.plant = FloatingPlant()
        self.port = TcpPort(push_port=push_port)
        self.node = PlaintextMotionController(MotionController(self.plant, deadman_s=None), [self.port])

    async def serve(self):
        polls = 0
        while True:
            polls += 1
            self.node.poll(0.01 * polls)
            await asyncio.sleep(0.0005)


@asynccontextmanager
async def served(monkeypatch):
    robot = Served(free_udp_port())
    monkeypatch.setattr(client, "_CONTROL_PORT", robot.port.port)
    monkeypatch.setattr(client, "_PUSH_PORT", robot.port._push_port)
    serving = asyncio.create_task(robot.serve())
    try:
        async with asyncio.timeout(PATIENCE_S):
            yield robot
    finally:
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving
        robot.node.shutdown()


def test_it_drives_asks_and_leaves_the_robot_standing(monkeypatch):
    async def session():
        async with served(monkeypatch) as robot:
            async with await connect_to_robomaster("127.0.0.1") as theirs:
                assert robot.node.is_taken
                assert await theirs.get_version() == "version"
                await theirs.set_speed(forwards=0.5, right=0.25, clockwise=45.0)
                while robot.plant.velocity_body == STOP:
                    await asyncio.sleep(0)
                vx, vy, wz = robot.plant.velocity_body
                told = await theirs.get_speed()
                assert (told.z, told.x, told.clockwise) == (0.5, 0.25, 45.0)
                assert (vx, vy) == (0.5, -0.25)
                assert wz == pytest.approx(-0.785398, abs=1e-6)
                assert (await theirs.get_rotation()).clockwise > 0.0
                assert (await theirs.get_attitude()).yaw > 0.0
                assert not (await theirs.get_status()).static
                await theirs.set_all_wheel_speeds(30)
                assert (await theirs.get_speed()).z == pytest.approx(0.157, abs=1e-3)
                await theirs.set_speed(0.0, 0.0)
                assert (await theirs.get_status()).static
            assert not robot.node.is_taken
            assert robot.plant.velocity_body == STOP

    asyncio.run(session())


@pytest.mark.parametrize(
    ("velocity", "front_right", "front_left", "back_left", "back_right"),
    [
        (BodyVelocity(0.5, 0.0, 0.0), 95, 95, 95, 95),
        (BodyVelocity(0.0, -0.5, 0.0), -95, 95, -95, 95),
        (BodyVelocity(0.0, 0.0, -1.5708), -60, 60, 60, -60),
    ],
)
def test_its_wheels_are_ours(monkeypatch, velocity, front_right, front_left, back_left, back_right):
    async def session():
        async with served(monkeypatch) as robot, await connect_to_robomaster("127.0.0.1") as theirs:
            await theirs.set_wheel_speed(front_right, front_left, back_left, back_right)
            wheels = (await theirs.get_speed()).wheels
            assert robot.plant.velocity_body == pytest.approx(velocity, abs=0.01)
            told = (wheels.front_right, wheels.front_left, wheels.back_left, wheels.back_right)
            assert told == pytest.approx((front_right, front_left, back_left, back_right), abs=0.01)

    asyncio.run(session())


def test_it_reads_the_pushed_telemetry(monkeypatch):
    async def session():
        async with served(monkeypatch) as robot, await connect_to_robomaster("127.0.0.1") as theirs:
            await theirs.set_rotation_push_rate(Frequency.Hz50)
            await theirs.set_speed(0.0, 0.0, 45.0)
            while (await theirs.rotation.get()).clockwise < 30.0:
                pass
            await theirs.set_rotation_push_rate(Frequency.Off)
            await theirs.set_attitude_push_rate(Frequency.Hz20)
            assert (await theirs.attitude.get()).yaw > 30.0
            # It begins by turning the recognition of lines off, of which this robot has none.
            assert robot.node.refused == 1

    asyncio.run(session())
