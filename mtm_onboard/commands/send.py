"""`mtm-onboard send`: another message, or none, for a robot that runs."""

import argparse

from mtm_onboard.commands.contentoptions import add_content, content_table
from mtm_onboard.commands.controloptions import add_robot, socket_path


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("send", help="give a running robot another message, from its next boundary on")
    add_robot(parser)
    add_content(parser).add_argument("--silence", action="store_true", help="no message, and so no noise")
    parser.set_defaults(handler=_send)


def _send(args: argparse.Namespace) -> int:
    from datetime import UTC, datetime

    from mtm_onboard.control.control import called
    from mtm_onboard.control.control_socket import ask

    request = {"command": "silence"} if args.silence else {"command": "send", "content": content_table(args)}
    answer = ask(socket_path(args), request)
    start = datetime.fromtimestamp(answer["unix_s"], UTC)
    slot = "" if answer["slot"] is None else f", slot {answer['slot']}"
    instead = "" if answer["replaces"] is None else f", in the place of {called(answer['replaces'])} that was waiting"
    begins = "silence" if args.silence else f"{called(answer['number'])}, {answer['content']},"
    print(f"{begins} begins at {start:%Y-%m-%d %H:%M:%S.%f} UTC ({answer['unix_s']:.6f}){slot}{instead}")
    return 0
