# mavsdk 3.17.4, pymavlink 2.4.50: when a MAVSDK program stops commanding, the last velocity goes on being sent at 20 Hz
#
# Behaviour: a program sets a body velocity 50 times a second for 2 s and then does nothing more.
#   While it calls, an autopilot on the same machine receives about 50 setpoints a second;
#   afterwards it still receives 20 a second, all with the last value, for as long as the program
#   lives and the autopilot reports offboard mode.
# Guess: setpoints are sent when set, so silence stops them and the autopilot's own time-out takes
#   over.
# So: a message that ends mid-swing leaves the robot moving, and the autopilot's time-out for lost
#   setpoints never comes. End with zero and offboard.stop(); and the repeats in a log are not
#   commands of the message.
# Source: https://mavsdk.mavlink.io/main/en/cpp/guide/offboard.html ("automatically resends
#   setpoints at 20Hz")
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile mavsdk==3.17.4 pymavlink==2.4.50
venv/bin/python - <<'END'
import os
os.environ["MAVLINK20"] = "1"
import asyncio, threading, time, warnings
warnings.simplefilter("ignore")
from mavsdk import System
from mavsdk.offboard import VelocityBodyYawspeed
from pymavlink import mavutil
received, done = [], threading.Event()
def autopilot():  # answers as far as MAVSDK needs it, on this machine only
    link = mavutil.mavlink_connection("udpout:127.0.0.1:14777", source_system=1, source_component=1)
    beat, mode = 0, 0
    while not done.is_set():
        if time.monotonic() - beat > 0.2:
            link.mav.heartbeat_send(2, 12, 81, mode, 4)
            beat = time.monotonic()
        m = link.recv_match(blocking=True, timeout=0.02)
        if m is not None and m.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            received.append(m.vx)
        elif m is not None and m.get_type() == "COMMAND_LONG":
            if m.command == 176:  # DO_SET_MODE: PX4's offboard mode from now on
                mode = 6 << 16
            link.mav.command_ack_send(m.command, 0)
thread = threading.Thread(target=autopilot)
thread.start()
async def main():
    drone = System(port=50099)
    await drone.connect(system_address="udpin://127.0.0.1:14777")
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    await drone.offboard.set_velocity_body(VelocityBodyYawspeed(0, 0, 0, 0))
    await drone.offboard.start()
    received.clear()
    start = time.monotonic()
    for i in range(1, 101):
        await drone.offboard.set_velocity_body(VelocityBodyYawspeed(0.001 * i, 0, 0, 0))
        await asyncio.sleep(max(0, start + 0.02 * i - time.monotonic()))
    during = len(received) / (time.monotonic() - start)
    await asyncio.sleep(0.5)
    received.clear()
    await asyncio.sleep(8)
    return during, len(received) / 8, {round(v, 3) for v in received}
try:
    during, after, values = asyncio.run(asyncio.wait_for(main(), 50))
finally:
    done.set()
    thread.join()
print(f"while calling: {during:.1f} setpoints/s; after the last call: {after:.1f}/s with values {values}")
assert during > 35 and 15 < after < 25 and values == {0.1}
END
