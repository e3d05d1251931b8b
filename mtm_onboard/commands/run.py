"""`mtm-onboard run`: the robot's runtime in real time."""

import argparse
import math
from pathlib import Path

from mtm_onboard.commands.contentoptions import add_content, content


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("run", help="drive the robot: base commands in, base commands and message out")
    parser.add_argument("--config", required=True, type=Path, metavar="FILE", help="the robot's configuration (TOML)")
    parser.add_argument("--key", required=True, type=Path, metavar="FILE", help="the key file")
    add_content(parser).add_argument(
        "--no-message", action="store_true", help="no noise until mtm-onboard send gives a message"
    )
    parser.add_argument("--no-repeat", action="store_true", help="send the message once, then base commands alone")
    parser.add_argument(
        "--duration", type=_seconds, default=math.inf, metavar="SECONDS", help="end this long after the message's start"
    )
    parser.add_argument(
        "--start-at", type=_seconds, metavar="SECONDS",
        help="the message's start in seconds since the Unix epoch, still to come and the same for robots that start "
        "together (now); under the rolling schedule the first slot from then on",
    )  # fmt: skip
    parser.add_argument(
        "--stdin", action="store_true", help="base commands from standard input; at its end the robot stands still"
    )
    parser.add_argument(
        "--allow-unsynchronised", action="store_true",
        help="rolling schedule: follow this computer's clock although nobody keeps it right, as in a lab",
    )  # fmt: skip
    parser.add_argument("--revoked", type=Path, metavar="FILE", help="the list that mtm-onboard revoke keeps")
    parser.set_defaults(handler=_run)


def _run(args: argparse.Namespace) -> int:
    from dataclasses import replace

    from mtm_onboard.control.session import Plan, run_session
    from mtm_onboard.protocol import load_key
    from mtm_onboard.protocol.revocation import load_revocations
    from mtm_onboard.runtime.config import SourceSettings, load_config
    from mtm_onboard.runtime.ending_signals import ending_signals

    config, key = load_config(args.config), load_key(args.key)
    if args.stdin:
        config = replace(config, source=SourceSettings("stdin"))
    if args.revoked is not None:
        load_revocations(args.revoked).check(key)
    plan = Plan(
        None if args.no_message else content(args), not args.no_repeat, args.start_at, args.duration,
        args.allow_unsynchronised,
    )  # fmt: skip
    with ending_signals() as asked_to_end:
        outcome = run_session(config, key, plan, asked_to_end, say=_say)
    print(outcome.summary())
    return 0


def _say(sentence: str) -> None:
    import sys

    print(f"mtm-onboard: {sentence}", file=sys.stderr, flush=True)


def _seconds(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value >= 0):
        raise ValueError
    return value
