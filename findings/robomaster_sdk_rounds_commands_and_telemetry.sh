# robomaster 0.1.1.68 (DJI's SDK): speeds are rounded to 1 cm/s and 1 degree/s, both when sent and when read back
#
# Behaviour: Chassis.drive_speed rounds x and y to 0.01 m/s and z to whole degrees a second before it
#   packs them as 32-bit floats, halves to even, and says nothing; a turn of 0.5 degrees/s is sent as
#   0, one of 1.5 as 2. What the robot reports is rounded in the same way before it is handed over:
#   velocities to 0.01 m/s. The wire itself carries floats in both directions.
# Guess: the floats that are passed in are the floats that leave, as they are in the message's layout.
# So: noise of 5 mm/s or 0.5 degrees/s is distorted or lost before it leaves the computer, and
#   cannot be measured through the same SDK. Write the message yourself, or dither.
# Source: the package's chassis.py (drive_speed, VelocitySubject) and util.py (UnitChecker);
#   https://github.com/dji-sdk/RoboMaster-SDK
# The one wheel is for Python 3.8, so it is unpacked and its codec used by itself.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile numpy==2.4.6
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --no-deps --only-binary :all: --python-version 3.8 \
  --implementation cp --abi cp38 --platform manylinux2014_x86_64 --target sdk robomaster==0.1.1.68
venv/bin/python - <<'END'
import struct
import sys
sys.path.insert(0, "sdk")
import numpy as np
from robomaster import chassis
class Client:  # stands for the connection and keeps the message that would be sent
    hostbyte = 0xC9
    def send_sync_msg(self, message):
        self.data = bytes(message.pack())
class Robot:
    client, action_dispatcher = Client(), None
driver = chassis.Chassis(Robot())
def sent(x=0.0, z=0.0):
    driver.drive_speed(x=x, z=z)
    forward, _, turn = struct.unpack("<fff", Robot.client.data[11:-2])
    return forward, turn
def reported(x):
    subject = chassis.VelocitySubject()
    subject.decode(struct.pack("<6f", 0, 0, 0, x, 0, 0))
    return subject.data_info()[3]
wave, kept = np.sin(2 * np.pi * np.arange(2000) / 100 + 0.1), {}
for mm in (4, 6, 10, 50):
    wanted = mm / 1000 * wave
    for name, through in (("sent", lambda v: sent(v)[0]), ("reported", reported)):
        kept[name, mm] = np.array([through(float(v)) for v in wanted]) @ wanted / (wanted @ wanted)
    print(f"sine of {mm} mm/s: {kept['sent', mm]:.2f} of it is sent, {kept['reported', mm]:.2f} of it is reported")
turns = [sent(z=turn)[1] for turn in (0.4, 0.5, 1.5, 2.5)]
print("turns of 0.4, 0.5, 1.5 and 2.5 degrees/s are sent as", turns)
assert turns == [0.0, 0.0, 2.0, 2.0]
assert all(kept[name, 4] == 0.0 and kept[name, 6] > 1.05 for name in ("sent", "reported"))
assert all(abs(kept[name, 50] - 1) < 0.02 for name in ("sent", "reported"))
END
