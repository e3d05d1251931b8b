# mcap 1.6.0: of an MCAP that lost its end, both readers give no message at all by default, though thousands are whole
#
# Behaviour: a recording of 40,000 poses is cut at 60 % of its bytes, as when a robot's battery
#   ends. make_reader and NonSeekingReader raise before the first message. NonSeekingReader with
#   log_time_order=False gives over 17,000 messages, in order, before it raises: everything in the
#   whole chunks.
# Guess: a reader that needs no index streams what is there and stops at the damage.
# So: catch the error and fall back to log_time_order=False, count what came, and say how much of
#   the time is missing.
# Source: NonSeekingReader sorts by reading everything first:
#   https://github.com/foxglove/mcap/blob/main/python/mcap/mcap/reader.py
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile mcap==1.6.0
venv/bin/python - <<'END'
import io, json
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer
whole = io.BytesIO()
writer = Writer(whole)
writer.start("", "example")
schema = writer.register_schema("pose", "jsonschema", b"{}")
channel = writer.register_channel("/pose", "json", schema)
for i in range(40000):
    writer.add_message(channel, i * 10**7, json.dumps({"i": i, "x": i * 0.1234}).encode(), i * 10**7)
writer.finish()
cut = whole.getvalue()[: len(whole.getvalue()) * 6 // 10]
def read(name, data, make, **keywords):
    times, problem = [], "no error"
    try:
        for _, _, message in make(io.BytesIO(data)).iter_messages(**keywords):
            times.append(message.log_time)
    except Exception as e:
        problem = type(e).__name__
    print(f"{name}: {len(times)} messages, {problem}")
    assert times == [i * 10**7 for i in range(len(times))]
    return len(times), problem
assert read("whole", whole.getvalue(), make_reader) == (40000, "no error")
for make in (make_reader, NonSeekingReader):
    n, problem = read("cut, " + make.__name__, cut, make)
    assert n == 0 and problem != "no error"
n, problem = read("cut, NonSeekingReader unsorted", cut, NonSeekingReader, log_time_order=False)
assert n > 15000 and problem == "EndOfFile"
END
