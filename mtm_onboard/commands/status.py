"""`mtm-onboard status`: how a running robot fares."""

import argparse
from typing import Any

from mtm_onboard.commands.controloptions import add_robot, socket_path


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("status", help="say how a running robot fares")
    add_robot(parser)
    parser.add_argument("--json", action="store_true", help="print JSON, with --watch one line each time")
    parser.add_argument(
        "--watch",
        type=_seconds,
        nargs="?",
        const=1.0,
        metavar="SECONDS",
        help="a line every so many seconds (1) until Ctrl-C",
    )
    parser.set_defaults(handler=_status)


def _status(args: argparse.Namespace) -> int:
    import json
    import time

    from mtm_onboard.control.control_socket import ask

    path = socket_path(args)
    answer = ask(path, {"command": "status"})
    if args.watch is None:
        print(json.dumps(answer, indent=2) if args.json else "\n".join(_lines(answer)))
        return 0
    try:
        while True:
            print(json.dumps(answer) if args.json else f"{time.strftime('%H:%M:%S')}  {_line(answer)}", flush=True)
            time.sleep(args.watch)
            answer = ask(path, {"command": "status"})
    except KeyboardInterrupt:
        return 0


def _lines(answer: dict[str, Any]) -> list[str]:
    """One line for each entry; those of a table within it get its name."""
    flat: dict[str, Any] = {}
    for name, value in answer.items():
        flat |= (
            {f"{name} {inner}": entry for inner, entry in value.items()} if isinstance(value, dict) else {name: value}
        )
    return [f"{name.replace('_', ' '):<20}{'none' if value is None else value}" for name, value in flat.items()]


def _line(answer: dict[str, Any]) -> str:
    from mtm_onboard.control.control import called

    content = "" if answer["content"] is None else f", {answer['content']}"
    age_s = answer["commands"]["age_s"]
    commands = "no base command yet" if age_s is None else f"last base command {age_s:.2f} s ago"
    link = "link up" if answer["link"]["up"] else f"link down ({answer['link']['fault'] or 'no reason known'})"
    return (
        f"{answer['state']}; tick {answer['tick']}; {called(answer['message'])}{content}; {commands}; {link}; "
        f"{answer['missed']} missed, {answer['unsent']} unsent"
    )


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.1 <= value <= 3600.0:
        raise argparse.ArgumentTypeError("give 0.1 to 3600 seconds")
    return value
