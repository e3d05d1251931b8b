"""The command line: `mtm-onboard <command>`. Exit codes: 0 done, 1 error, 2 usage, 130 interrupted."""

import argparse
import contextlib
import os
import sys
from collections.abc import Sequence
from importlib import import_module

# Each module has `add_parser(subparsers)`, which sets `handler(args) -> int`, and imports what it needs only in there.
_COMMANDS = (
    "mtm_onboard.commands.keygen",
    "mtm_onboard.commands.issue",
    "mtm_onboard.commands.anchor",
    "mtm_onboard.commands.disclose",
    "mtm_onboard.commands.revoke",
    "mtm_onboard.commands.show",
    "mtm_onboard.commands.doctor",
    "mtm_onboard.commands.run",
    "mtm_onboard.commands.send",
    "mtm_onboard.commands.status",
    "mtm_onboard.commands.stop",
    "mtm_onboard.commands.export",
    "mtm_onboard.commands.device_key",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; usage errors leave with 2 through SystemExit."""
    try:
        return _run(arguments)
    except KeyboardInterrupt:
        print("mtm-onboard: interrupted; nothing was written", file=sys.stderr)
        return 130


def parser_of() -> argparse.ArgumentParser:
    """The command line of all commands."""
    parser = argparse.ArgumentParser(prog="mtm-onboard", description=import_module("mtm_onboard").__doc__)
    subparsers = parser.add_subparsers(required=True, metavar="command")
    for command in _COMMANDS:
        import_module(command).add_parser(subparsers)
    return parser


def _run(arguments: Sequence[str] | None) -> int:
    args = parser_of().parse_args(arguments)

    from mtm_onboard.protocol.errors import MtmError

    try:
        code: int = args.handler(args)
        # Here, where it can still be told, and not when the interpreter ends.
        sys.stdout.flush()
    except MtmError as error:
        print(f"mtm-onboard: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        print("mtm-onboard: nobody reads the output any more, so its end is lost; let it be read", file=sys.stderr)
        _discard_output()
        return 1
    except OSError as error:
        print(f"mtm-onboard: the system refused ({error}); check disk space and permissions", file=sys.stderr)
        _discard_output()
        return 1
    return code


def _discard_output() -> None:
    """Let what is still buffered for standard output go nowhere, where it cannot fail a second time."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
