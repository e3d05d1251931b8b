# python-can 4.6.1, pyserial 3.5: slcan sends an error frame as a data frame of identifier 0 and gives no error frames back
#
# Behaviour: a recording with error frames is replayed through the slcan interface. The line
#   protocol has no error frames; python-can does not refuse them but writes "T000000000" for the
#   default Message(is_error_frame=True), a valid extended data frame with identifier 0, the highest
#   priority on the bus. Read back, it is a data frame.
# Guess: what an interface cannot send it refuses, as it refuses other impossible things.
# So: filter error frames out before replaying a log; on a real bus such a frame wins every
#   arbitration, and a receiver may take it for a command.
# Source: https://github.com/hardbyte/python-can/blob/main/can/interfaces/slcan.py (send)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile python-can==4.6.1 pyserial==3.5
venv/bin/python - <<'END'
import os, pty, time, tty
import can
from can.interfaces.slcan import slcanBus
master, slave = pty.openpty()
tty.setraw(master)
tty.setraw(slave)
bus = slcanBus(channel=os.ttyname(slave), bitrate=500000, sleep_after_open=0)
time.sleep(0.2)
os.read(master, 1000)  # set-up commands
def line(message):
    bus.send(message)
    time.sleep(0.05)
    return os.read(master, 1000)
data = line(can.Message(arbitration_id=0x123, data=[1, 2], is_extended_id=False))
error = line(can.Message(is_error_frame=True))
os.write(master, error)
back = bus.recv(timeout=2)
print(f"data frame: {data}; error frame: {error}; read back: id {back.arbitration_id}, error frame {back.is_error_frame}")
bus.shutdown()
assert data == b"t12320102\r" and error == b"T000000000\r"
assert back.arbitration_id == 0 and not back.is_error_frame and back.is_extended_id
END
