"""A ROS 2 node that drives ours: publishes `cmd_vel`, and `/clock` when asked, and prints what comes out.

Each line of output is JSON: {"t": seconds, "ros": ROS seconds, "twist": [six numbers]}, or {"stop": [success, message]}
after the line `stop` on its input; `quiet` ends the commands and `back` sets the clock back by five seconds.
"""

import argparse
import json
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

BEGAN_S = 1000.0


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--reliability", choices=["reliable", "best_effort"], default="reliable")
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--clock-hz", type=float, default=0.0)
    parser.add_argument("--speed-up", type=float, default=1.0)
    options = parser.parse_args()

    rclpy.init()
    node = rclpy.create_node("peer")
    began_s, asked, set_back_s = time.monotonic(), [], [0.0]

    def ros_s() -> float:
        return BEGAN_S + options.speed_up * (time.monotonic() - began_s) - set_back_s[0]

    def heard(twist: Twist) -> None:
        linear, angular = twist.linear, twist.angular
        six = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
        print(json.dumps({"t": time.monotonic(), "ros": ros_s(), "twist": six}), flush=True)

    node.create_subscription(Twist, "cmd_vel_out", heard, 100)
    reliability = getattr(ReliabilityPolicy, options.reliability.upper())
    commands = node.create_publisher(Twist, "cmd_vel", QoSProfile(depth=5, reliability=reliability))
    stop = node.create_client(Trigger, "/robot0/stop")
    command = Twist()
    command.linear.x = 0.3
    driving = node.create_timer(1.0 / options.rate, lambda: commands.publish(command))
    if options.clock_hz:
        clock = node.create_publisher(Clock, "/clock", 10)

        def tell() -> None:
            message = Clock()
            message.clock.sec, rest = divmod(int(ros_s() * 1e9), 10**9)
            message.clock.nanosec = rest
            clock.publish(message)

        node.create_timer(1.0 / (options.clock_hz * options.speed_up), tell)

    def listen() -> None:
        for line in sys.stdin:
            asked.append(line.strip())

    threading.Thread(target=listen, daemon=True).start()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.05)
        word = asked.pop(0) if asked else ""
        if word == "quit":
            return
        if word == "quiet":
            driving.cancel()
        if word == "back":
            set_back_s[0] = 5.0
        if word == "stop":
            stop.wait_for_service(10.0)
            future = stop.call_async(Trigger.Request())
            future.add_done_callback(
                lambda done: print(json.dumps({"stop": [done.result().success, done.result().message]}), flush=True)
            )


if __name__ == "__main__":
    main()
