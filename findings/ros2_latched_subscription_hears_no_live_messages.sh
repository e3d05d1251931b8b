# ros-kilted-rclpy 9.1.2, ros-kilted-rmw-fastrtps-cpp 9.3.3: a subscription that asks for more than is offered receives nothing at all, not even live messages
#
# Behaviour: a transient-local ("latched") subscription to an ordinary publisher, or a reliable one
#   to a best-effort publisher (as sensors have), receives 0 of 30 messages sent while it listens.
#   The topic is listed, count_publishers says 1; one warning line is logged on each side. The other
#   way round all arrive.
# Guess: asking for old messages adds to the live ones, asking for reliability does the best it can.
# So: a recorder must ask for the least: best effort and volatile; "0 messages" with 1 publisher
#   means a mismatch of QoS and is worth an error.
# Source:
#   https://docs.ros.org/en/kilted/Concepts/Intermediate/About-Quality-of-Service-Settings.html
#   (tables of compatibility)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile ros-kilted-rclpy==9.1.2 ros-kilted-rmw-fastrtps-cpp==9.3.3 ros-kilted-std-msgs==5.5.1
venv/bin/python - <<'END'
import os
os.environ.update(ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_DOMAIN_ID="59")
import time
import rclpy
from rclpy.qos import DurabilityPolicy as D, QoSProfile, ReliabilityPolicy as R
from std_msgs.msg import Float64
rclpy.init()
node = rclpy.create_node("robot")
def spin(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.01)
def heard(topic, offered, asked):
    got = []
    profile = lambda pair: QoSProfile(depth=50, reliability=pair[0], durability=pair[1])
    publisher = node.create_publisher(Float64, topic, profile(offered))
    node.create_subscription(Float64, topic, lambda m: got.append(m.data), profile(asked))
    spin(0.5)
    for i in range(30):
        publisher.publish(Float64(data=float(i)))
        spin(0.02)
    spin(0.5)
    name = lambda pair: f"{pair[0].name}, {pair[1].name}".lower()
    print(f"offered {name(offered)}; asked {name(asked)}: {len(got)} of 30, publishers listed {node.count_publishers(topic)}")
    assert node.count_publishers(topic) == 1
    return len(got)
plain, latched, sensor = (R.RELIABLE, D.VOLATILE), (R.RELIABLE, D.TRANSIENT_LOCAL), (R.BEST_EFFORT, D.VOLATILE)
assert heard("a", plain, plain) >= 28
assert heard("b", plain, latched) == 0
assert heard("c", sensor, plain) == 0
assert heard("d", latched, plain) >= 28
assert heard("e", plain, sensor) >= 28
END
