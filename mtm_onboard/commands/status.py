"""`mtm-onboard status`: how a running robot fares."""

import argparse

from mtm_onboard.commands.controloptions import add_robot, socket_path


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("status", help="say how a running robot fares")
    add_robot(parser)
    parser.set_defaults(handler=_status)


def _status(args: argparse.Namespace) -> int:
    from mtm_onboard.control.control_socket import ask

    answer = ask(socket_path(args), {"command": "status"})
    link = {f"link {name}": value for name, value in answer.pop("link").items()}
    for name, value in (answer | link).items():
        print(f"{name.replace('_', ' '):<20}{'none' if value is None else value}")
    return 0
