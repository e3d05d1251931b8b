"""Opening a recording that is text."""

from pathlib import Path

from mtm_onboard.protocol.errors import MtmError


def check_readable(path: Path) -> None:
    """Raise MtmError unless `path` is a file with something in it that may be read."""
    try:
        if path.is_dir():
            raise MtmError(f"{path} is a folder; name the recording inside it")
        with path.open("rb") as file:
            first = file.read(1)
    except FileNotFoundError as error:
        raise MtmError(f"there is no file {path}; check the name") from error
    except (OSError, ValueError) as error:
        raise MtmError(f"{path} cannot be read ({error}); check its permissions") from error
    if not first:
        raise MtmError(f"{path} is empty; record it anew or copy it again")


def read_lines(path: Path) -> list[str]:
    """All lines of a text file (UTF-8); raises MtmError when it is missing, empty or not text."""
    check_readable(path)
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except (UnicodeDecodeError, OSError) as error:
        raise MtmError(f"{path} is not UTF-8 text; motion capture must be a TUM or CSV text file") from error
