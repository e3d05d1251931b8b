"""`mtm-onboard disclose`: the key of a day that is over, with which everybody verifies films of that day."""

import argparse
from pathlib import Path

from mtm_onboard.commands.dayoptions import day
from mtm_onboard.commands.issue import add_master


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("disclose", help="give out the key of a day that is over, for everybody to verify")
    add_master(parser)
    parser.add_argument("--day", required=True, type=day, metavar="DAY", help="the day, in UTC, such as 2026-01-31")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="the file to write; it must not exist")
    parser.add_argument(
        "--allow-unsynchronised",
        action="store_true",
        help="believe this computer's clock although nobody keeps it right",
    )
    parser.set_defaults(handler=_disclose)


def _disclose(args: argparse.Namespace) -> int:
    from mtm_onboard.commands.trusted_clock import trusted_now
    from mtm_onboard.protocol import load_key
    from mtm_onboard.protocol.disclosure import disclosed_key, save_disclosed

    key = load_key(args.master)
    now = trusted_now("a day given out too early can be forged", allow_unsynchronised=args.allow_unsynchronised)
    disclosed = disclosed_key(key, args.day, now)
    save_disclosed(disclosed, args.out)
    print(f"wrote the key of {args.day} to {args.out}; once it is public, films made later prove nothing")
    return 0
