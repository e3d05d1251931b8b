"""The command line: `mtm-onboard <command>`. Exit codes: docs/command-line.md."""

import argparse
import contextlib
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from mtm_onboard.commands.completion import SHELLS, completion_script
from mtm_onboard.commands.parser import Parser

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


def parser_of(word: str = "") -> Parser:
    """The command line of all commands; where `word` is one of them, of that one, so that no other is imported."""
    parser = Parser(prog="mtm-onboard", description=import_module("mtm_onboard").__doc__)
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    parser.add_argument(
        "--show-completion",
        action=_Completion,
        metavar="SHELL",
        choices=SHELLS,
        help="print what completes commands in a shell",
    )
    subparsers = parser.add_subparsers(metavar="COMMAND", title="Commands", parser_class=Parser)
    for command in [command for command in _COMMANDS if _word_of(command) == word] or _COMMANDS:
        import_module(command).add_parser(subparsers)
    for own in subparsers.choices.values():
        own.set_defaults(parser=own)
    return parser


def _word_of(command: str) -> str:
    return command.rpartition(".")[2].replace("_", "-")


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"mtm-onboard {version('messages-through-motion')}")
        except PackageNotFoundError:
            print("mtm-onboard (not installed, so without a version)")
        parser.exit()


class _Completion(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(completion_script(parser), end="")
        parser.exit()


def _run(arguments: Sequence[str] | None) -> int:
    words = list(sys.argv[1:] if arguments is None else arguments)
    parser = parser_of(words[0] if words else "")
    args = parser.parse_args(words)
    if "handler" not in args:
        print(parser.format_help(), end="", file=sys.stderr)
        return 2

    from mtm_onboard.protocol.errors import MtmError

    try:
        code: int = args.handler(args)
        # Here, where it can still be told, and not when the interpreter ends.
        sys.stdout.flush()
    except MtmError as error:
        print(f"mtm-onboard: {error}", file=sys.stderr)
        return error.exit_code
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
