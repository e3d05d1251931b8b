# cflib 0.1.34: a Crazyflie's setpoints turn pitch round in two calls of three, and "degrees/s" of one of them is read as radians/s
#
# Behaviour: send_setpoint and send_setpoint_manual put -pitch on the wire, send_zdistance_setpoint
#   puts pitch, with the same argument name and unit. send_full_state_setpoint documents rates in
#   degrees/s but sends 1000 times the number in 16 bits; the firmware reads that as milliradians/s,
#   so 30 means 30 rad/s, and 40 cannot be packed.
# Guess: one commander has one convention for pitch and for rates.
# So: a robot changed from one setpoint to another pitches the other way, and a yaw rate given in
#   degrees is 57 times too fast. Test sign and size of each axis for the one call that is used;
#   give full-state rates in radians/s.
# Source: https://github.com/bitcraze/crazyflie-lib-python/blob/master/cflib/crazyflie/commander.py
#   and, for fullStatePacket_s,
#   https://github.com/bitcraze/crazyflie-firmware/blob/master/src/modules/src/crtp_commander_generic.c
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile cflib==0.1.34
venv/bin/python - <<'END'
import struct
from cflib.crazyflie.commander import Commander
class Link:  # stands for a connected Crazyflie and keeps the packet that would be sent
    class platform:
        get_protocol_version = staticmethod(lambda: 11)
    def send_packet(self, packet):
        self.data = bytes(packet.data)
link = Link()
commander = Commander(link)
commander.send_setpoint(0, 5, 0, 20000)
plain = struct.unpack("<fffH", link.data)[1]
commander.send_setpoint_manual(0, 5, 0, 50, False)
manual = struct.unpack("<BfffHB", link.data)[2]
commander.send_zdistance_setpoint(0, 5, 0, 1)
zdistance = struct.unpack("<Bffff", link.data)[2]
print(f"pitch 5 degrees on the wire: setpoint {plain}, manual {manual}, zdistance {zdistance}")
def yaw_rate(rate):
    commander.send_full_state_setpoint([0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0, 1], 0, 0, rate)
    return struct.unpack("<BhhhhhhhhhIhhh", link.data)[-1]
sent = yaw_rate(30)
try:
    limit = yaw_rate(40)
except struct.error as e:
    limit = f"struct.error: {e}"
print(f"yaw rate 30: {sent} on the wire, {sent / 1000 * 57.29578:.0f} degrees/s to the firmware; yaw rate 40: {limit}")
assert (plain, manual, zdistance) == (-5, -5, 5)
assert sent == 30000 and str(limit).startswith("struct.error")
assert "rollrate, pitchrate, yawrate are in degrees/s" in Commander.send_full_state_setpoint.__doc__
END
