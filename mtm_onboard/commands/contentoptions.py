"""The options that say a message's content, shared by the commands that take one."""

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mtm_onboard.runtime.message import Content

_OPTIONS = {"message": "number", "text": "text", "hex": "hex", "symbols": "symbols"}


def add_content(parser: argparse.ArgumentParser) -> "argparse._MutuallyExclusiveGroup":
    """Add the options, exactly one of which must be given, and return their group."""
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument("--message", type=int, metavar="N", help="the message as a number")
    group.add_argument("--text", metavar="TEXT", help="the message as text, for keys whose payload is text")
    group.add_argument("--hex", metavar="HEX", help="the message as bytes, for keys whose payload is bytes")
    group.add_argument(
        "--symbols", type=_symbols, metavar="S,S,...", help="the whole message as symbols, for keys without framing"
    )
    return group


def content_table(args: argparse.Namespace) -> dict[str, Any]:
    """What was given, as a request has it; empty when none of the options was."""
    return {kind: getattr(args, name) for name, kind in _OPTIONS.items() if getattr(args, name) is not None}


def content(args: argparse.Namespace) -> "Content":
    """What was given; raises MtmError when it is malformed."""
    from mtm_onboard.protocol.errors import command_line_values
    from mtm_onboard.runtime.message import content_from_table

    with command_line_values():
        return content_from_table(content_table(args))


def _symbols(text: str) -> tuple[int, ...]:
    return tuple(int(symbol) for symbol in text.split(","))
