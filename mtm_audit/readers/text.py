"""Opening a recording that is text."""

from pathlib import Path

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, opened, read_text

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


def read_lines(path: Path) -> list[str]:
    """All lines of a text file (UTF-8); raises MtmError when it is missing, empty or not text."""
    check_readable(path)
    try:
        return read_text(path, "the recording", _LARGEST_BYTES).removeprefix("\ufeff").splitlines()
    except BrokenTextError as error:
        raise MtmError(f"{path} is not UTF-8 text; motion capture must be a TUM or CSV text file") from error
