# ros-kilted-rclpy 9.1.2, ros-kilted-rmw-fastrtps-cpp 9.3.3: under use_sim_time a timer ticks at most once for each /clock message
#
# Behaviour: a node with use_sim_time has a timer of 20 ms. Fed by a /clock that steps by 100 ms, it
#   ticks once a step, 10 times a simulated second instead of 50, at the clock's times and not its
#   own. With steps of 10 ms it ticks 50 times. When the clock is set back by 50 s the ticks go on
#   from there.
# Guess: a 50 Hz timer in simulated time makes 50 ticks a second of that time, catching up in
#   bursts.
# So: a sender that counts ticks is five times too slow under a 10 Hz clock and nothing warns. Count
#   by now(), and compare the step of /clock with the tick.
# Source: https://github.com/ros2/rclcpp/issues/2268 and
#   https://design.ros2.org/articles/clock_and_time.html
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile ros-kilted-rclpy==9.1.2 ros-kilted-rmw-fastrtps-cpp==9.3.3 ros-kilted-rosgraph-msgs==2.3.0
venv/bin/python - <<'END'
import os
os.environ.update(ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_DOMAIN_ID="57")
import time
import rclpy
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
rclpy.init()
node = rclpy.create_node("robot", parameter_overrides=[Parameter("use_sim_time", value=True)])
publisher = rclpy.create_node("simulator").create_publisher(Clock, "/clock", 10)
ticks = []
node.create_timer(0.02, lambda: ticks.append(node.get_clock().now().nanoseconds / 1e9))
def spin(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.005)
while publisher.get_subscription_count() == 0:
    spin(0.05)
spin(0.5)
assert not ticks, "no tick before the first /clock message"
def run(start, step, steps):
    before = len(ticks)
    for i in range(1, steps + 1):
        t = round((start + i * step) * 1e9)
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(t, 10**9)
        publisher.publish(message)
        spin(0.08)
    n = len(ticks) - before
    print(f"clock from {start} s in {steps} steps of {step} s: {n} ticks, {n / (steps * step):.1f} a simulated second")
    return n
run(99, 0.1, 2)
assert 15 <= run(100, 0.1, 20) <= 20, "one a message, not 100"
assert 20 <= run(102, 0.01, 50) <= 26, "with a fine clock 50 a second"
assert run(52, 0.02, 20) >= 15, "set back by 50 s: the ticks go on"
END
