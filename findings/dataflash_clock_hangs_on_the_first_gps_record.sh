# pymavlink 2.4.50: one late first GPS record shifts every time of an ArduPilot DataFlash log
#
# Behaviour: DFReader takes the difference between GPS time and the board's TimeUS from the first
#   usable GPS record alone. If that record was logged 300 ms after the fix it holds (start-up is
#   when the logger is busiest), the whole log is 300 ms early, and every later record that would
#   tell is ignored.
# Guess: the clock is fitted over all GPS records, or at least checked against them.
# So: times of a log and of a film or a motion capture system disagree by a constant that changes
#   with each start of the robot. Fit the median of GPS time minus TimeUS yourself.
# Source: find_time_base in https://github.com/ArduPilot/pymavlink/blob/master/DFReader.py
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile pymavlink==2.4.50
venv/bin/python - <<'END'
import struct
from pymavlink import DFReader
def format_of(kind, length, name, letters, columns):
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode())
def offsets(late_ms):
    data = format_of(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    data += format_of(10, 19, "POS", "Qff", "TimeUS,X,Y")
    data += format_of(11, 19, "GPS", "QBIHB", "TimeUS,Status,GMS,GWk,NSats")
    for i in range(400):
        us = 1_000_000 + 20_000 * i
        data += b"\xa3\x95\x0a" + struct.pack("<Qff", us, 0.1 * i, 0)
        if i % 10 == 0 and i >= 20:
            logged = us + (late_ms * 1000 if i == 20 else 0)
            data += b"\xa3\x95\x0b" + struct.pack("<QBIHB", logged, 3, 302_400_000 + us // 1000, 2300, 10)
    with open("flight.bin", "wb") as f:
        f.write(data)
    log, out = DFReader.DFReader_binary("flight.bin", zero_time_base=False), []
    while (m := log.recv_msg()) is not None:
        if m.get_type() == "GPS":
            truth = 315964800 + m.GWk * 7 * 86400 + m.GMS / 1000 - 18  # GPS epoch, 18 leap seconds
            out.append(m._timestamp - truth)
    print(f"first GPS record {late_ms} ms late: {len(out)} records, read minus GPS time "
          f"{out[0]:+.3f} s at the first, {min(out[1:]):+.3f} to {max(out[1:]):+.3f} s at the others")
    return out
assert max(map(abs, offsets(0))) < 1e-3
out = offsets(300)
assert abs(out[0]) < 1e-3 and all(abs(o + 0.3) < 1e-3 for o in out[1:])
END
