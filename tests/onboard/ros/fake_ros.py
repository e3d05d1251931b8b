"""As much of ROS 2 as the node uses: messages, and an rclpy whose executor plays a script instead of a network."""

import sys
import threading
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Twist:
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)

    def six(self) -> tuple[float, ...]:
        return (
            self.linear.x, self.linear.y, self.linear.z, self.angular.x, self.angular.y, self.angular.z,
        )  # fmt: skip


class Trigger:
    @dataclass
    class Response:
        success: bool = False
        message: str = ""


def twist(vx_mps: float, vy_mps: float, wz_radps: float) -> Twist:
    return Twist(Vector3(vx_mps, vy_mps, 0.0), Vector3(0.0, 0.0, wz_radps))


class Node:
    """Keeps what was published, logged and set up; `events` has it in the order of ROS's own calls."""

    def __init__(self, ros: "FakeRos") -> None:
        self._ros = ros
        self.subscriptions: dict[str, Callable[[Twist], None]] = {}
        self.services: dict[str, Callable[[Any, Any], Any]] = {}
        self.errors: list[str] = []
        self.infos: list[str] = []

    def get_name(self) -> str:
        return "mtm"

    def declare_parameter(self, name, value, descriptor):
        assert descriptor.dynamic_typing
        return types.SimpleNamespace(value=self._ros.parameters.get(name, value))

    def create_publisher(self, kind, topic, depth):
        assert (kind, topic, depth) == (Twist, "cmd_vel_out", 1)

        def publish(message: Twist) -> None:
            assert "destroyed" not in self._ros.events
            self._ros.published.append(message)
            self._ros.events.append("published")

        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, depth) -> None:
        assert (kind, depth) == (Twist, 1)
        self.subscriptions[topic] = callback

    def create_service(self, kind, name, callback) -> None:
        assert kind is Trigger
        self.services[name] = callback

    def get_logger(self):
        return types.SimpleNamespace(error=self.errors.append, info=self.infos.append)

    def destroy_node(self) -> None:
        self._ros.events.append("destroyed")


class FakeRos:
    """Each of the executor's turns is one step of `script`, a function of this that yields between its steps."""

    def __init__(self, parameters: dict[str, Any], script: Callable[["FakeRos"], Iterator[None]]) -> None:
        self.parameters = parameters
        self.published: list[Twist] = []
        self.events: list[str] = []
        self.node = Node(self)
        self._script = script(self)

    def command(self, message: Twist) -> None:
        self.node.subscriptions["cmd_vel"](message)

    def call_stop(self) -> Trigger.Response:
        return self.node.services["~/stop"](object(), Trigger.Response())

    def spin_once(self, timeout_sec: float) -> None:
        threading.Event().wait(0.002)
        next(self._script, None)

    def install(self, monkeypatch) -> None:
        executor = types.SimpleNamespace(add_node=lambda node: None, spin_once=self.spin_once)
        no_handlers = object()

        def init(args, signal_handler_options) -> None:
            assert signal_handler_options is no_handlers
            self.events.append("initialised")

        modules = {
            "rclpy": {
                "init": init, "ok": lambda: True, "create_node": lambda name: self.node,
                "try_shutdown": lambda: self.events.append("shut down"),
            },
            "rclpy.signals": {"SignalHandlerOptions": types.SimpleNamespace(NO=no_handlers)},
            "rclpy.executors": {"SingleThreadedExecutor": lambda: executor},
            "rcl_interfaces": {},
            "rcl_interfaces.msg": {"ParameterDescriptor": types.SimpleNamespace},
            "geometry_msgs": {},
            "geometry_msgs.msg": {"Twist": Twist},
            "std_srvs": {},
            "std_srvs.srv": {"Trigger": Trigger},
        }  # fmt: skip
        for name, contents in modules.items():
            module = types.ModuleType(name)
            vars(module).update(contents)
            monkeypatch.setitem(sys.modules, name, module)
