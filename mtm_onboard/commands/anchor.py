"""`mtm-onboard anchor`: the public end of a master's chain of days, by which everybody verifies disclosed ones."""

import argparse
from pathlib import Path

from mtm_onboard.commands.issue import add_master


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("anchor", help="write what verifies disclosed days; it is public")
    add_master(parser)
    parser.add_argument(
        "--out", required=True, type=Path, metavar="FILE", help="the anchor to write; it must not exist"
    )
    parser.set_defaults(handler=_anchor)


def _anchor(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol import load_key
    from mtm_onboard.protocol.disclosure import anchor_of, save_anchor

    anchor = anchor_of(load_key(args.master))
    save_anchor(anchor, args.out)
    print(f"wrote the anchor of {anchor.id} to {args.out}: {anchor.first_day} to {anchor.last_day}; publish it")
    return 0
