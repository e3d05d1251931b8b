"""Drives a PX4 vehicle with MAVSDK: `offboard.py PORT SERVER_PORT`. Prints what it has reached, a word a line."""

import asyncio
import sys

from mavsdk import System
from mavsdk.offboard import VelocityBodyYawspeed


async def main() -> None:
    vehicle = System(port=int(sys.argv[2]))
    await vehicle.connect(system_address=f"udpin://127.0.0.1:{sys.argv[1]}")
    async for state in vehicle.core.connection_state():
        if state.is_connected:
            break
    print("connected", flush=True)
    await vehicle.action.arm()
    print("armed", flush=True)
    velocity = VelocityBodyYawspeed(0.5, 0.25, 0.0, 10.0)
    await vehicle.offboard.set_velocity_body(velocity)
    await asyncio.sleep(1.5)
    await vehicle.offboard.start()
    print("offboard", flush=True)
    await asyncio.sleep(3.0)
    await vehicle.offboard.stop()
    print("ended", flush=True)


asyncio.run(main())
