# djitellopy 2.5.0: a Tello's stop is dropped without a word when it follows a command within a millisecond
#
# Behaviour: send_rc_control(30, 0, 0, 0) followed at once by send_rc_control(0, 0, 0, 0) sends one
#   packet, "rc 30 0 0 0". The second call returns like the first, nothing is queued for later, and
#   the drone keeps flying at 30 until something else is sent. After 2 ms it is sent.
# Guess: commands faster than the limit are delayed or merged, the newest wins, or the call says so.
# So: a burst that corrects itself (set, clip, stop) ends in its first value. Send once a tick, and
#   repeat a stop.
# Source: https://github.com/damiafuentes/DJITelloPy/blob/master/djitellopy/tello.py
#   (send_rc_control, TIME_BTW_RC_CONTROL_COMMANDS)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile djitellopy==2.5.0
venv/bin/python - <<'END'
import logging, time
from djitellopy import Tello
Tello.LOGGER.setLevel(logging.ERROR)
class Recorder(Tello):  # keeps the packets that would be sent to the drone
    sent = []
    def send_command_without_return(self, command):
        self.sent.append(command)
tello = Recorder("127.0.0.1")
def run(pause):
    time.sleep(0.01)
    tello.sent.clear()
    begin = time.time()
    tello.send_rc_control(30, 0, 0, 0)
    time.sleep(pause)
    result = tello.send_rc_control(0, 0, 0, 0)
    return time.time() - begin, list(tello.sent), result
at_once = [(sent, result) for took, sent, result in (run(0) for _ in range(100)) if took < 0.001]
_, later, _ = run(0.005)
print(f"{len(at_once)} of 100 pairs within a millisecond, sent {at_once[0][0]}, the second call returned {at_once[0][1]}")
print(f"a pause of 5 ms: sent {later}")
assert at_once and all(sent == ["rc 30 0 0 0"] and result is None for sent, result in at_once)
assert later == ["rc 30 0 0 0", "rc 0 0 0 0"]
END
