"""Reading what somebody names as input: a file with an end and bearable size, never a pipe, device or folder."""

import os
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from mtm_onboard.protocol.errors import MtmError

LARGEST_TEXT_BYTES = 1_000_000
# TOML promises whole numbers of 64 bits, and arithmetic with floats fails on much longer ones.
_LARGEST_NUMBER = 1 << 63


class BrokenTextError(Exception):
    """What was read is not of the format that it should be; its text says in which way, and may quote the file."""


@contextmanager
def opened(path: Path, what: str) -> Iterator[BinaryIO]:
    """Yield the open file; `what` names it in errors, such as "the key file".

    Opening never waits, as that of a pipe without a writer would. Raises MtmError when there is no such file, when it
    may not be read, and when it is no regular one.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no file has such a name"
        raise MtmError(f"cannot read {what} {path}: {reason}; check the name") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise MtmError(f"{path} is not a file but a folder, pipe or device; name {what}")
    with os.fdopen(descriptor, "rb") as file:
        yield file


def read_text(path: Path, what: str, largest_bytes: int = LARGEST_TEXT_BYTES) -> str:
    """The file's text (UTF-8); raises MtmError as `opened` does and when it is larger, BrokenTextError for no text."""
    with opened(path, what) as file:
        return decoded(file, path, largest_bytes)


def decoded(file: BinaryIO, path: Path, largest_bytes: int = LARGEST_TEXT_BYTES) -> str:
    """The rest of an open file as text; raises as `read_text` does."""
    try:
        data = file.read(largest_bytes + 1)
    except OSError as error:
        raise MtmError(f"cannot read {path}: {error.strerror}; copy it again") from error
    if len(data) > largest_bytes:
        raise MtmError(f"{path} has more than {largest_bytes} bytes; name the right file")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BrokenTextError("it is not text") from error


def parsed_toml(text: str) -> dict[str, Any]:
    """The table in a TOML text; raises BrokenTextError when it is none or holds a whole number beyond 64 bits."""
    try:
        table = tomllib.loads(text)
    except RecursionError as error:
        raise BrokenTextError("it is nested too deeply") from error
    except ValueError as error:
        # Most are the parser's own; a number of thousands of digits is refused by Python itself.
        raise BrokenTextError(str(error)) from error
    _check_numbers(table)
    return table


def _check_numbers(table: dict[str, Any]) -> None:
    waiting: list[tuple[str, Any]] = list(table.items())
    while waiting:
        name, value = waiting.pop()
        if isinstance(value, dict):
            waiting.extend(value.items())
        elif isinstance(value, list):
            waiting.extend((name, entry) for entry in value)
        elif isinstance(value, int) and not -_LARGEST_NUMBER <= value < _LARGEST_NUMBER:
            raise BrokenTextError(f"the whole number of {name} does not fit into 64 bits")
