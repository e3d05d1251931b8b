"""`mtm-onboard issue`: a robot's or an auditor's file, cut from the master."""

import argparse
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_onboard.commands.dayoptions import add_days, first_day, instant

if TYPE_CHECKING:
    from mtm_onboard.protocol import Key
    from mtm_onboard.protocol.master import MasterHolding

_USUAL_DAYS = 31


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("issue", help="cut a key file for a robot or an auditor from the master")
    add_master(parser)
    holder = parser.add_mutually_exclusive_group(required=True)
    holder.add_argument(
        "--channel", action="append", metavar="NAME", help="for a robot: a channel that it plays, once for each"
    )
    holder.add_argument("--auditor", action="store_true", help="for an auditor: all channels")
    add_days(parser, _USUAL_DAYS)
    parser.add_argument(
        "--not-after", type=instant, metavar="TIME",
        help="when the file expires, such as 2026-01-31T12:00:00Z (with its last day)",
    )  # fmt: skip
    parser.add_argument(
        "--out", required=True, type=Path, metavar="FILE", help="the key file to write; it must not exist"
    )
    parser.set_defaults(handler=_issue)


def _issue(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol import Key, MtmError, save_key
    from mtm_onboard.protocol.holding import DayHolding, RobotHolding
    from mtm_onboard.protocol.holding_file import check_days

    key, master = load_master(args.master)
    first = first_day(args)
    try:
        last = first + timedelta(args.days - 1)
    except OverflowError as error:
        raise MtmError(f"{args.days} days from {first} on end after the year 9999; give fewer") from error
    check_days(first, last)
    held: DayHolding | RobotHolding
    if args.auditor:
        held, whose = master.for_auditor(first, last, args.not_after), "an auditor"
    else:
        held = master.for_robot(args.channel, first, last, args.not_after)
        whose = f"the robot of {', '.join(held.grant.channels)}"
    save_key(Key(key.id, held, key.scheme), args.out)
    print(
        f"wrote key {key.id} for {whose} to {args.out}: {first} to {last}, serial {held.grant.serial}; keep it secret, "
        "and note the serial, by which it is revoked"
    )
    return 0


def add_master(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the master."""
    parser.add_argument(
        "--master", required=True, type=Path, metavar="FILE", help="the master's file, which mtm-onboard keygen made"
    )


def load_master(path: Path) -> "tuple[Key, MasterHolding]":
    """The master and what it holds; raises MtmError when the file is none."""
    from mtm_onboard.protocol import MtmError, load_key
    from mtm_onboard.protocol.master import MasterHolding

    key = load_key(path)
    if not isinstance(key.secret, MasterHolding):
        what = "of format 1" if key.holding.grant is None else f"for a holder of the kind {key.holding.grant.kind}"
        raise MtmError(f"{path} is no master but {what}; name the file that mtm-onboard keygen made")
    return key, key.secret
