# pymavlink 2.4.50: a .tlog that begins in MAVLink 1 and goes on in MAVLink 2 is read without the version 2 messages, and MAVLINK20=0 repairs it
#
# Behaviour: 100 heartbeats in version 1, then 100 ODOMETRY (message 331) and LOCAL_POSITION_NED in
#   version 2, as on a link that changes to version 2 after it began. mavlink_connection reads
#   ODOMETRY as UNKNOWN_331; a filter for type ODOMETRY gives none, and nothing is raised. With the
#   variable MAVLINK20 in the environment all are read, even if its value is 0.
# Guess: the reader follows the protocol version of each packet; MAVLINK20=0 asks for version 1.
# So: set MAVLINK20=1 before pymavlink is imported, and count UNKNOWN_ messages before a log is said
#   to have no odometry.
# Source: https://github.com/ArduPilot/pymavlink/blob/master/mavutil.py (set_dialect and mavlink20,
#   which ask whether 'MAVLINK20' is in os.environ)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile pymavlink==2.4.50
venv/bin/python - <<'END'
import os, struct, subprocess, sys
from pymavlink.dialects.v10 import common as v1
from pymavlink.dialects.v20 import common as v2
one, two, zeros = v1.MAVLink(None, 1, 1), v2.MAVLink(None, 1, 1), [0.0] * 21
with open("flight.tlog", "wb") as f:
    def write(t, packet):
        f.write(struct.pack(">Q", round(t * 1e6)) + packet)
    for i in range(100):
        write(1.7e9 + i / 50, v1.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3).pack(one))
    for i in range(100):
        t = 1.7e9 + 2 + i / 50
        write(t, v2.MAVLink_odometry_message(i * 20000, 1, 8, i / 10, 0, 0, [1, 0, 0, 0], .1, 0, 0, 0, 0, 0, zeros, zeros, 0, 1, 77).pack(two))
        write(t + .001, v2.MAVLink_local_position_ned_message(i * 20, i / 10, 0, 0, .1, 0, 0).pack(two))
READ = """
from collections import Counter
from pymavlink import mavutil
log, seen = mavutil.mavlink_connection("flight.tlog"), Counter()
while (m := log.recv_match()) is not None:
    seen[m.get_type()] += 1
print(dict(sorted(seen.items())))
"""
def read(value):
    env = {k: v for k, v in os.environ.items() if k not in ("MAVLINK20", "MAVLINK09")}
    if value is not None:
        env["MAVLINK20"] = value
    out = subprocess.run([sys.executable, "-c", READ], env=env, capture_output=True, text=True, check=True).stdout
    print(f"MAVLINK20 {'unset' if value is None else '= ' + value}: {out.strip()}")
    return eval(out)
both = {"HEARTBEAT": 100, "LOCAL_POSITION_NED": 100, "ODOMETRY": 100}
assert read(None) == {"HEARTBEAT": 100, "LOCAL_POSITION_NED": 100, "UNKNOWN_331": 100}
assert read("1") == read("0") == both
END
