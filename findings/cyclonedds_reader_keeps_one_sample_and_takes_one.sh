# cyclonedds 11.0.1: a CycloneDDS reader keeps only the newest sample, is best effort, and take() hands out one at a time
#
# Behaviour: 100 samples are written in a burst. A DataReader with default QoS holds 1 of them, the
#   last; with History.KeepAll it holds all, but take() without an argument returns a list of one,
#   so a loop that takes once a tick falls further and further behind. The default reader asks for
#   best effort, the default writer offers reliable.
# Guess: from ROS 2, whose default is a reliable queue of 10: nothing is lost at this pace, and
#   take() takes all.
# So: state History and Reliability on both sides, and take(n) with n above what a tick can bring.
# Source: https://cyclonedds.io/docs/cyclonedds-python/latest/ (Qos, DataReader.take: N = 1)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile cyclonedds==11.0.1
venv/bin/python - <<'END'
import time
from dataclasses import dataclass
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
@dataclass
class Pose(IdlStruct, typename="Pose"):
    number: int
    x: float
participant = DomainParticipant(77)
def burst(name, qos):
    topic = Topic(participant, name, Pose)
    reader, writer = DataReader(participant, topic, qos=qos), DataWriter(participant, topic)
    time.sleep(0.5)
    for i in range(100):
        writer.write(Pose(number=i, x=0.1 * i))
    time.sleep(0.5)
    return reader, writer
reader, writer = burst("default", None)
held = [s.number for s in reader.take(1000)]
print("default reader holds", held)
print("asks for", [p for p in reader.get_qos() if isinstance(p, (Policy.History.KeepLast, type(Policy.Reliability.BestEffort)))])
assert held == [99]
assert Policy.Reliability.BestEffort in reader.get_qos() and Policy.Reliability.BestEffort not in writer.get_qos()
reader, writer = burst("all", Qos(Policy.History.KeepAll))
first, second, rest = reader.take(), reader.take(), reader.take(1000)
print(f"KeepAll: take() gave {len(first)}, then {len(second)}, take(1000) the other {len(rest)}")
assert (len(first), len(second), len(rest)) == (1, 1, 98) and rest[0].number == 2
END
