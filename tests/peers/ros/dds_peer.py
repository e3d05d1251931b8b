"""Drives our node from Eclipse Cyclone DDS, without ROS: a Twist as DDS carries it for ROS 2. Prints what comes out."""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    """Three components."""

    x: float64
    y: float64
    z: float64


@dataclass
class Twist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    """A velocity."""

    linear: Vector3
    angular: Vector3


def main() -> None:
    participant = DomainParticipant(int(sys.argv[1]))
    qos = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100))
    writer = DataWriter(participant, Topic(participant, "rt/cmd_vel", Twist), qos=qos)
    reader = DataReader(participant, Topic(participant, "rt/cmd_vel_out", Twist), qos=reliable)
    while True:
        writer.write(Twist(Vector3(0.3, 0.0, 0.0), Vector3(0.0, 0.0, 0.0)))
        for twist in reader.take(100):
            if hasattr(twist, "linear"):
                six = [twist.linear.x, twist.linear.y, twist.linear.z, 0.0, 0.0, twist.angular.z]
                print(json.dumps({"t": time.monotonic(), "twist": six}), flush=True)
        time.sleep(0.02)


if __name__ == "__main__":
    main()
