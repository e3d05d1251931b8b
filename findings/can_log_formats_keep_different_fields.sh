# python-can 4.6.1: the ending of a CAN log's name decides which of time, direction, channel and error frames survive
#
# Behaviour: six messages, one of them an error frame and two sent by the logger itself, are written
#   and read back through can.Logger and can.LogReader. .asc comes back with times from 0 instead of
#   the clock's; .csv and .db lose the channel and whether a frame was sent or received; .trc drops
#   the error frame and gives channel 2 for 1; .log gives the channel as text. Only .blf returns
#   all.
# Guess: the formats differ in size and speed, and times at least are common to all.
# So: a recording to be set against a film must not be .asc, and one whose own commands must be told
#   from the robot's answers must not be .csv or .db. Record .blf.
# Source: https://python-can.readthedocs.io/en/stable/file_io.html and
#   https://github.com/hardbyte/python-can/tree/main/can/io (ASCReader: relative_timestamp)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile python-can==4.6.1
venv/bin/python - <<'END'
import logging
import can
logging.disable(logging.WARNING)
start = 1700000000.123456
messages = [can.Message(timestamp=start + 0.01 * i, arbitration_id=0x100 + i, data=[i] * 8, is_extended_id=False, channel=1,
                        is_rx=i % 2 == 0) for i in range(4)]
messages.append(can.Message(timestamp=start + 0.05, is_error_frame=True, channel=1))
messages.append(can.Message(timestamp=start + 0.06, arbitration_id=0x1FFFFFFF, data=[1], channel=1))
kept = {}
for ending in ("asc", "blf", "csv", "db", "log", "trc"):
    with can.Logger("drive." + ending) as logger:
        for m in messages:
            logger.on_message_received(m)
    read = list(can.LogReader("drive." + ending))
    clock = all(abs(m.timestamp - start) < 1 for m in read)
    kept[ending] = (len(read), clock, sum(not m.is_rx for m in read), sum(m.is_error_frame for m in read), read[0].channel)
    print(f".{ending}: {kept[ending][0]} of 6 messages, clock time {clock}, {kept[ending][2]} of 2 sent, "
          f"{kept[ending][3]} of 1 error frames, channel {kept[ending][4]!r}")
assert kept == {"asc": (6, False, 2, 1, 1), "blf": (6, True, 2, 1, 1), "csv": (6, True, 0, 1, None),
                "db": (6, True, 0, 1, None), "log": (6, True, 2, 1, "can1"), "trc": (5, True, 2, 0, 2)}
END
