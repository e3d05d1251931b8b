"""`mtm-onboard revoke`: a key file that is no longer trusted, such as a stolen robot's, onto the list of those."""

import argparse
from datetime import UTC, datetime
from pathlib import Path

from mtm_onboard.commands.dayoptions import instant


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("revoke", help="put a key file on the list of those that are no longer trusted")
    parser.add_argument("--list", required=True, type=Path, metavar="FILE", help="the list, which is made or added to")
    parser.add_argument(
        "--serial", required=True, metavar="SERIAL", help="the file's serial, which issue told and show tells"
    )
    parser.add_argument(
        "--channel",
        action="append",
        default=[],
        metavar="NAME",
        help="a channel that the file can play; none for auditors",
    )
    parser.add_argument("--since", type=instant, metavar="TIME", help="since when it is not trusted (now)")
    parser.set_defaults(handler=_revoke)


def _revoke(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol.errors import command_line_values
    from mtm_onboard.protocol.revocation import RevocationList, load_revocations, revoked_entry, save_revocations

    since = datetime.now(UTC).replace(microsecond=0) if args.since is None else args.since
    with command_line_values():
        entry = revoked_entry(args.serial, tuple(args.channel), since)
    former = load_revocations(args.list) if args.list.exists() else RevocationList()
    save_revocations(former.with_entry(entry), args.list)
    print(f"{args.list} has serial {entry.serial}; give it to robots (run --revoked) and auditors (decode --revoked)")
    return 0
