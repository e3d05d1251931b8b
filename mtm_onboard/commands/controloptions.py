"""The options that say which running robot is meant, shared by the commands that ask one."""

import argparse
from pathlib import Path


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Add the options, one of which must be given."""
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument(
        "--config", type=Path, metavar="FILE", help="the robot's configuration (TOML), which names its control socket"
    )
    group.add_argument("--socket", type=Path, metavar="PATH", help="the robot's control socket itself")


def socket_path(args: argparse.Namespace) -> Path:
    """The control socket; raises MtmError when the configuration names none."""
    from mtm_onboard.protocol import MtmError
    from mtm_onboard.runtime.config import load_config

    if args.socket is not None:
        return Path(args.socket)
    control = load_config(args.config).control
    if control is None:
        raise MtmError(f"{args.config} has no control socket; add [control] with a socket and start the run anew")
    return Path(control.socket)
