"""The node: twists on `cmd_vel` in, twists on `cmd_vel_out` out, and a service `~/stop` for the operator.

Needs ROS 2 Humble or later, sourced: rclpy, geometry_msgs, std_srvs and rcl_interfaces are imported by `main` alone.
"""

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

from mtm_onboard.control.session import Ends, run_session
from mtm_onboard.model.clock import Clock, SystemClock
from mtm_onboard.protocol import MtmError, load_key
from mtm_onboard.ros.parameters import DEFAULTS, config_of, key_path, plan_of
from mtm_onboard.ros.ros_time import RosTime
from mtm_onboard.ros.spinning import Spinning
from mtm_onboard.ros.twist import velocity_of
from mtm_onboard.ros.twistlink import TwistLink
from mtm_onboard.runtime.ending_signals import ending_signals
from mtm_onboard.runtime.source import HeldSource

# Commands that wait for a slow reader are old ones.
_DEPTH = 1
_SPIN_S = 0.1


def main(arguments: Sequence[str] | None = None) -> int:
    """Run until a signal or ROS ends it, and leave a twist of zeros behind; `arguments` as ROS has them."""
    # From here on, since ROS takes a second to load and to find its peers.
    with ending_signals() as asked:
        try:
            import rclpy
            from rclpy.signals import SignalHandlerOptions
        except ImportError as error:
            print(f"mtm: ROS 2 is not at hand ({error}); source its setup file first", file=sys.stderr)
            return 1
        try:
            # Its own handlers would take the topics away before the robot was told to stop.
            rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
            node = rclpy.create_node("mtm")
        except Exception as error:
            print(f"mtm: ROS 2 does not start ({' '.join(str(error).split())}); correct its arguments", file=sys.stderr)
            rclpy.try_shutdown()
            return 1
        try:
            _run(node, asked)
        except MtmError as error:
            node.get_logger().error(str(error))
            return 1
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
    return 0


def _run(node: Any, asked: Callable[[], bool]) -> None:
    import rclpy
    from rcl_interfaces.msg import ParameterDescriptor
    from rclpy.executors import SingleThreadedExecutor

    # Dynamic, so that a limit of 1 is a number as well as one of 1.0; what they may be is checked with the rest.
    any_kind = ParameterDescriptor(dynamic_typing=True)
    values = {name: node.declare_parameter(name, default, any_kind).value for name, default in DEFAULTS.items()}
    key, config, plan = load_key(key_path(values)), config_of(values, node.get_name()), plan_of(values)
    log = node.get_logger()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with Spinning(lambda: executor.spin_once(timeout_sec=_SPIN_S)) as spinning:

        def ended() -> bool:
            return asked() or spinning.error is not None or not rclpy.ok()

        simulated = bool(node.get_parameter("use_sim_time").value)
        clock = _ros_time(node, 1.0 / key.scheme.rate_hz, ended) if simulated else SystemClock()
        ends = _ends(node, clock, simulated=simulated)
        outcome = run_session(config, key, plan, ended, ends, say=log.info)
    if spinning.error is not None:
        raise MtmError(f"ROS failed ({spinning.error!r}) and the robot was told to stop; start the node anew")
    log.info(outcome.summary())


def _ros_time(node: Any, period_s: float, ended: Callable[[], bool]) -> RosTime:
    """ROS time, from its first message on: before that it is zero, and no tick could be told from it."""
    log, clock = node.get_logger(), node.get_clock()

    def now_s() -> float:
        return float(clock.now().nanoseconds * 1e-9)

    if not now_s():
        log.info("use_sim_time is set, so the robot stands still until /clock is published")
    while not now_s() and not ended():
        time.sleep(_SPIN_S)
    return RosTime(now_s, period_s, ended, log.warning)


def _ends(node: Any, clock: Clock, *, simulated: bool) -> Ends:
    from geometry_msgs.msg import Twist
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from std_srvs.srv import Trigger

    source = HeldSource()
    publisher = node.create_publisher(Twist, "cmd_vel_out", _DEPTH)

    def stop(_: Any, response: Any) -> Any:
        source.stop()
        response.success, response.message = True, "the robot stands still until the node is started anew"
        return response

    def take(twist: Any) -> None:
        source.set(velocity_of(twist), clock.now())

    # Hears reliable publishers and those of sensor data alike; a reliable one would hear nothing of the latter.
    heard = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(Twist, "cmd_vel", take, heard)
    node.create_service(Trigger, "~/stop", stop)
    heard_name, sent_name = map(node.resolve_topic_name, ("cmd_vel", "cmd_vel_out"))
    return Ends(
        source=source,
        transport=TwistLink(Twist, publisher.publish),
        clock=clock,
        simulated=simulated,
        source_name=f"the topic {heard_name}",
        link_name=f"the topic {sent_name}",
        stop_by=f"call the service {node.resolve_service_name('~/stop')}",
    )
