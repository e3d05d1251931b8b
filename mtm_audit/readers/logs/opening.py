"""How a file begins: what formats are recognised by."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from mtm_audit.readers.text import decoded_lines, is_text, read_start

_BYTES = 65_536


@dataclass(frozen=True)
class Opening:
    """The first 64 KiB of a file; `start` is empty for a folder."""

    path: Path
    start: bytes

    @property
    def suffix(self) -> str:
        """The end of the name in small letters, such as ".csv"."""
        return self.path.suffix.lower()

    @property
    def is_text(self) -> bool:
        """Whether the file begins as text."""
        return bool(self.start) and is_text(self.start[:4096])

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The first lines, comments included; none of a file that is no text."""
        if not self.is_text:
            return ()
        lines = decoded_lines(self.start)
        # The last one may be cut.
        return tuple(lines[:-1] if len(self.start) == _BYTES else lines)

    @cached_property
    def content(self) -> tuple[str, ...]:
        """The first lines that are neither blank nor comments."""
        return tuple(line for line in self.lines if line.strip() and not line.lstrip().startswith("#"))


def opening_of(path: Path) -> Opening:
    """The opening of a file or folder; raises MtmError when it is missing, empty or may not be read."""
    return Opening(path, b"") if path.is_dir() else Opening(path, read_start(path, _BYTES))
