"""`mtm-onboard run`: the robot's runtime in real time."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_onboard.commands.contentoptions import add_content, content

if TYPE_CHECKING:
    from mtm_onboard.protocol import Key
    from mtm_onboard.runtime.message import Content


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("run", help="drive the robot: base commands in, base commands and message out")
    parser.add_argument("--config", required=True, type=Path, metavar="FILE", help="the robot's configuration (TOML)")
    parser.add_argument("--key", type=Path, metavar="FILE", help="the key file, unless --anchor is given")
    what = add_content(parser)
    what.add_argument("--no-message", action="store_true", help="no noise until mtm-onboard send gives a message")
    what.add_argument(
        "--disclosed", type=Path, metavar="FILE", help="with --anchor: the key of a day that is over, for everybody"
    )
    parser.add_argument(
        "--anchor", type=Path, metavar="FILE", help="the fleet's anchor, on whose public channel --disclosed is played"
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
    parser.set_defaults(handler=_run, usage_error=parser.error)


def _run(args: argparse.Namespace) -> int:
    from dataclasses import replace

    from mtm_onboard.control.session import Plan, run_session
    from mtm_onboard.protocol.revocation import load_revocations
    from mtm_onboard.runtime.config import SourceSettings, load_config
    from mtm_onboard.runtime.ending_signals import ending_signals

    if (args.anchor is None) != (args.disclosed is None) or (args.anchor is None) == (args.key is None):
        args.usage_error("give a key with a message, or else an anchor with a disclosed key")
    config = load_config(args.config)
    key, said = _carried(args) if args.key is None else _asked(args)
    if args.stdin:
        config = replace(config, source=SourceSettings("stdin"))
    if args.revoked is not None:
        load_revocations(args.revoked).check(key)
    plan = Plan(
        said, not args.no_repeat, args.start_at, args.duration,
        args.allow_unsynchronised,
    )  # fmt: skip
    with ending_signals() as asked_to_end:
        outcome = run_session(config, key, plan, asked_to_end, say=_say)
    print(outcome.summary())
    return 0


def _asked(args: argparse.Namespace) -> "tuple[Key, Content | None]":
    """A key and what to send with it."""
    from mtm_onboard.protocol import load_key

    return load_key(args.key), None if args.no_message else content(args)


def _carried(args: argparse.Namespace) -> "tuple[Key, Content | None]":
    """The public channel's key, and the disclosed one as its message, once that may be public."""
    from mtm_onboard.commands.trusted_clock import trusted_now
    from mtm_onboard.protocol.disclosure import load_anchor, load_disclosed
    from mtm_onboard.protocol.public_channel import link_to_carry, public_key

    now = trusted_now(
        "a key played too early can be used to forge its day", allow_unsynchronised=args.allow_unsynchronised
    )
    anchor = load_anchor(args.anchor)
    link = link_to_carry(anchor, load_disclosed(args.disclosed, anchor), now)
    return public_key(anchor), link


def _say(sentence: str) -> None:
    import sys

    print(f"mtm-onboard: {sentence}", file=sys.stderr, flush=True)


def _seconds(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value >= 0):
        raise ValueError
    return value
