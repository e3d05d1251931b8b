# cflib 0.1.34, numpy 2.4.6: a Crazyflie's full state setpoint cuts velocities to whole millimetres per second, towards zero
#
# Behaviour: send_full_state_setpoint packs position, velocity and acceleration as int(1000 * x). A
#   sine of 20 mm/s keeps 97 % of its size on the wire, one of 5 mm/s 84 %, one of 2 mm/s 56 % and
#   one of 1 mm/s nothing; there is a dead zone of 2 mm/s round zero. The hover and velocity
#   setpoints send 32-bit floats.
# Guess: all setpoints carry floats, or round to the nearest step, which would keep small sines.
# So: a quiet message added to the velocity is distorted before it leaves the computer, the more the
#   quieter it is. Send velocity or hover setpoints, or dither.
# Source: https://github.com/bitcraze/crazyflie-lib-python/blob/master/cflib/crazyflie/commander.py
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile cflib==0.1.34 numpy==2.4.6
venv/bin/python - <<'END'
import struct
import numpy as np
from cflib.crazyflie.commander import Commander
class Link:  # stands for a connected Crazyflie and keeps the packet that would be sent
    class platform:
        get_protocol_version = staticmethod(lambda: 11)
    def send_packet(self, packet):
        self.data = bytes(packet.data)
link = Link()
commander = Commander(link)
def full_state(vx):
    commander.send_full_state_setpoint([0, 0, 1], [vx, 0, 0], [0, 0, 0], [0, 0, 0, 1], 0, 0, 0)
    return struct.unpack("<BhhhhhhhhhIhhh", link.data)[4] / 1000
def hover(vx):
    commander.send_hover_setpoint(vx, 0, 0, 1)
    return struct.unpack("<Bffff", link.data)[1]
wave, kept = np.sin(2 * np.pi * np.arange(2000) / 100 + 0.1), {}
for mm in (1, 2, 5, 20):
    wanted = mm / 1000 * wave
    for send in (full_state, hover):
        sent = np.array([send(v) for v in wanted])
        kept[send.__name__, mm] = (sent @ wanted) / (wanted @ wanted)
    print(f"sine of {mm} mm/s: full state keeps {kept['full_state', mm]:.2f}, hover {kept['hover', mm]:.2f}")
assert full_state(0.0009) == full_state(-0.0009) == 0 and full_state(0.0019) == 0.001
assert kept["full_state", 1] < 0.05 and 0.45 < kept["full_state", 2] < 0.7
assert 0.75 < kept["full_state", 5] < 0.9 and kept["full_state", 20] > 0.94
assert all(abs(kept["hover", mm] - 1) < 1e-4 for mm in (1, 2, 5, 20))
END
