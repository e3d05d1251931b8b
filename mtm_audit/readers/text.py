"""Opening a recording that is text, in whatever way programs write it."""

import codecs
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened

# A day of motion capture at 300 Hz takes half of it.
_LARGEST_BYTES = 4 << 30


def check_readable(path: Path) -> None:
    """Raise MtmError unless `path` is a file with something in it that may be read."""
    if path.is_dir():
        raise MtmError(f"{path} is a folder; name the recording inside it")
    with opened(path, "the recording") as file:
        first = file.read(1)
    if not first:
        raise MtmError(f"{path} is empty; record it anew or copy it again")


def read_start(path: Path, count: int) -> bytes:
    """The first `count` bytes of a file at most; raises MtmError when it is missing, empty, or may not be read."""
    check_readable(path)
    with opened(path, "the recording") as file:
        return file.read(count)


def encoding_of(start: bytes) -> str:
    """The encoding of text that begins so: its byte-order mark, or UTF-16 by its zeros, or UTF-8."""
    if start.startswith(codecs.BOM_UTF8):
        return "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    even, odd = start[:256:2], start[1:256:2]
    # Numbers and separators have a zero in each pair of bytes.
    if odd and odd.count(0) == len(odd) and not even.count(0):
        return "utf-16-le"
    if odd and even.count(0) == len(even) and not odd.count(0):
        return "utf-16-be"
    return "utf-8"


def is_text(start: bytes) -> bool:
    """Whether a file that begins so is text in an encoding known here."""
    return encoding_of(start) != "utf-8" or b"\0" not in start


def decoded_lines(data: bytes) -> list[str]:
    """Lines of text; what is not valid in UTF-8 was written by a program in its country's code page."""
    encoding = encoding_of(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode(encoding, "replace") if encoding.startswith("utf-16") else data.decode("latin-1")
    return text.removeprefix("\ufeff").splitlines()


def read_bytes(path: Path) -> bytes:
    """All bytes of a file; raises MtmError when it is missing, empty or too large."""
    check_readable(path)
    with opened(path, "the recording") as file:
        try:
            data = file.read(_LARGEST_BYTES + 1)
        except OSError as error:
            raise MtmError(f"cannot read {path}: {error.strerror}; copy it again") from error
    if len(data) > _LARGEST_BYTES:
        raise MtmError(f"{path} has more than {_LARGEST_BYTES} bytes; cut it into parts")
    return data


def read_lines(path: Path) -> list[str]:
    """All lines of a text file; raises MtmError as `read_bytes` does, and when it is not text."""
    data = read_bytes(path)
    if not is_text(data[:4096]):
        raise MtmError(f"{path} is not text; motion capture must be a table of text or one of docs/formats.md")
    return decoded_lines(data)
