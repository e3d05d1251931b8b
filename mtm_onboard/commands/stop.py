"""`mtm-onboard stop`: the operator's stop for a robot that runs."""

import argparse

from mtm_onboard.commands.controloptions import add_robot, socket_path


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("stop", help="stop a running robot; it stands still until its run is started anew")
    add_robot(parser)
    parser.set_defaults(handler=_stop)


def _stop(args: argparse.Namespace) -> int:
    from mtm_onboard.control.control_socket import ask

    ask(socket_path(args), {"command": "stop"})
    print("the robot stands still from its next tick on; start the run anew to move it again")
    return 0
