"""The command line: `mtm-onboard <command>`. Exit codes: 0 done, 1 error, 2 usage, 130 interrupted."""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

# Each module has `add_parser(subparsers)`, which sets `handler(args) -> int`, and imports what it needs only in there.
_COMMANDS = (
    "mtm_onboard.commands.keygen",
    "mtm_onboard.commands.show",
    "mtm_onboard.commands.doctor",
    "mtm_onboard.commands.run",
    "mtm_onboard.commands.send",
    "mtm_onboard.commands.status",
    "mtm_onboard.commands.stop",
    "mtm_onboard.commands.export",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; usage errors leave with 2 through SystemExit."""
    parser = argparse.ArgumentParser(prog="mtm-onboard", description=import_module("mtm_onboard").__doc__)
    subparsers = parser.add_subparsers(required=True, metavar="command")
    for command in _COMMANDS:
        import_module(command).add_parser(subparsers)
    args = parser.parse_args(arguments)

    from mtm_onboard.protocol.errors import MtmError

    try:
        code: int = args.handler(args)
    except MtmError as error:
        print(f"mtm-onboard: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"mtm-onboard: the system refused ({error}); check disk space and permissions", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("mtm-onboard: interrupted; nothing was written", file=sys.stderr)
        return 130
    return code
