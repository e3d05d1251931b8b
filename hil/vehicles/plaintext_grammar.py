"""The text that a RoboMaster EP takes, read as strictly as its SDK server reads it: words, values and numbers."""

import re
from dataclasses import dataclass

DONE = "ok"
FAILED = "fail"
PARSE_ERROR = "command format error: command parse error"

_SEQUENCE = re.compile(r"[0-9]+|0x[0-9A-Fa-f]+")
_DIGITS = re.compile(r"[0-9]+")
_HEX = re.compile(r"0x[0-9A-Fa-f]+")


class RefusalError(Exception):
    """A command that cannot be obeyed; its text is the robot's answer."""


@dataclass(frozen=True)
class Command:
    """A command's words, and what its answer ends in: its sequence number as it was written, or nothing."""

    words: tuple[str, ...]
    echo: str


def parse_command(text: str) -> Command:
    """The command between two semicolons; raises RefusalError for a bad sequence number or an empty word."""
    words = text.split(" ")
    echo = ""
    if "seq" in words:
        place = words.index("seq")
        if place + 2 > len(words):
            raise RefusalError("command format error: no seq value")
        number = words[place + 1]
        if place + 2 < len(words) or not _SEQUENCE.fullmatch(number):
            raise RefusalError("command format error: seq parse error")
        words, echo = words[:place], f" seq {number}"
    if not all(words):
        raise RefusalError(PARSE_ERROR + echo)
    return Command(tuple(words), echo)


def number(word: str) -> float:
    """A value as the robot reads it: digits, 0x and hexadecimal digits, or whatever Python takes for a float.

    Raises RefusalError for anything else.
    """
    try:
        if _DIGITS.fullmatch(word):
            return float(int(word))
        if _HEX.fullmatch(word):
            return float(int(word, 16))
        return float(word)
    except (ValueError, OverflowError):
        raise RefusalError(PARSE_ERROR) from None


def values(words: tuple[str, ...], keys: tuple[str, ...]) -> dict[str, float]:
    """The numbers of `key value key value ...`; raises RefusalError for a key that is unknown or comes twice."""
    pairs = dict(zip(words[::2], words[1::2], strict=False))
    if not words or 2 * len(pairs) != len(words) or not set(pairs) <= set(keys):
        raise RefusalError(PARSE_ERROR)
    return {key: number(word) for key, word in pairs.items()}
