"""The node: twists on `cmd_vel` in, twists on `cmd_vel_out` out, and a service `~/stop` for the operator.

Needs ROS 2 Humble or later, sourced: rclpy, geometry_msgs, std_srvs and rcl_interfaces are imported by `main` alone.
"""

import sys
from collections.abc import Sequence
from typing import Any

from mtm_onboard.control.session import Ends, run_session
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.protocol import MtmError, load_key
from mtm_onboard.ros.parameters import DEFAULTS, config_of, key_path, plan_of
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
    try:
        import rclpy
        from rclpy.signals import SignalHandlerOptions
    except ImportError as error:
        print(f"mtm: ROS 2 is not at hand ({error}); source its setup file first", file=sys.stderr)
        return 1
    # Its own handlers would take the topics away before the robot was told to stop.
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node("mtm")
        try:
            _run(node)
        except MtmError as error:
            node.get_logger().error(str(error))
            return 1
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()
    return 0


def _run(node: Any) -> None:
    import rclpy
    from rcl_interfaces.msg import ParameterDescriptor
    from rclpy.executors import SingleThreadedExecutor

    # Dynamic, so that a limit of 1 is a number as well as one of 1.0; what they may be is checked with the rest.
    any_kind = ParameterDescriptor(dynamic_typing=True)
    values = {name: node.declare_parameter(name, default, any_kind).value for name, default in DEFAULTS.items()}
    key, config, plan = load_key(key_path(values)), config_of(values, node.get_name()), plan_of(values)
    ends = _ends(node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with ending_signals() as asked, Spinning(lambda: executor.spin_once(timeout_sec=_SPIN_S)) as spinning:
        outcome = run_session(config, key, plan, lambda: asked() or spinning.error is not None or not rclpy.ok(), ends)
    if spinning.error is not None:
        raise MtmError(f"ROS failed ({spinning.error!r}) and the robot was told to stop; start the node anew")
    node.get_logger().info(outcome.summary())


def _ends(node: Any) -> Ends:
    from geometry_msgs.msg import Twist
    from std_srvs.srv import Trigger

    source, clock = HeldSource(), SystemClock()
    publisher = node.create_publisher(Twist, "cmd_vel_out", _DEPTH)

    def stop(_: Any, response: Any) -> Any:
        source.stop()
        response.success, response.message = True, "the robot stands still until the node is started anew"
        return response

    node.create_subscription(Twist, "cmd_vel", lambda twist: source.set(velocity_of(twist), clock.now()), _DEPTH)
    node.create_service(Trigger, "~/stop", stop)
    return Ends(source, TwistLink(Twist, publisher.publish))
