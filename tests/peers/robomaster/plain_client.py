"""Drives a RoboMaster EP with a library for real ones: `python plain_client.py LIBRARY PORT PUSH_PORT`.

Prints what was asked and answered as JSON, a line each.
"""

import asyncio
import importlib.util
import json
import sys
import types

library, port, push_port = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])


def tell(**facts: object) -> None:
    print(json.dumps(facts), flush=True)


def robomasterpy() -> None:
    import time

    # The package itself loads a framework that wants OpenCV; the client alone is what drives.
    package = types.ModuleType("robomasterpy")
    package.__path__ = list(importlib.util.find_spec("robomasterpy").submodule_search_locations)
    sys.modules["robomasterpy"] = package
    from robomasterpy import client

    client.CTRL_PORT = port
    robot = client.Commander(ip="127.0.0.1", timeout=10.0)
    tell(version=robot.version())
    robot.robot_mode("chassis_lead")
    tell(mode=robot.get_robot_mode())
    robot.chassis_speed(0.5, 0.25, 30)
    time.sleep(0.5)
    speed = robot.get_chassis_speed()
    tell(speed=[speed.x, speed.y, speed.z])
    attitude = robot.get_chassis_attitude()
    tell(yaw=attitude.yaw)
    robot.chassis_speed(0, 0, 0)
    tell(position=[robot.get_chassis_position().x, robot.get_chassis_position().y])
    robot.chassis_wheel(10, 10, 10, 10)
    time.sleep(0.3)
    tell(wheels=True)
    robot.chassis_speed(0, 0, 0)
    robot.close()


async def sbhs_robomaster() -> None:
    from sbhs_robomaster import client, connect_to_robomaster

    client._CONTROL_PORT, client._PUSH_PORT = port, push_port
    async with await connect_to_robomaster("127.0.0.1") as robot:
        tell(version=await robot.get_version())
        await robot.set_speed(forwards=0.5, right=0.25, clockwise=30.0)
        await asyncio.sleep(0.5)
        speed = await robot.get_speed()
        tell(speed=[speed.z, speed.x, speed.clockwise])
        tell(yaw=(await robot.get_attitude()).yaw)
        await robot.set_speed(0.0, 0.0, 0.0)


if library == "robomasterpy":
    robomasterpy()
else:
    asyncio.run(sbhs_robomaster())
