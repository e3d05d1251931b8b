"""What a recording's files hold, as SHA-256."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Content:
    """The name of each file, from its folder on where a folder was named, and the SHA-256 of what it holds."""

    files: tuple[tuple[str, str], ...]

    @property
    def sha256(self) -> str:
        """Of the file, or of the list that `sha256sum` prints of several, in hexadecimal digits."""
        if len(self.files) == 1:
            return self.files[0][1]
        lines = "".join(f"{digest}  {name}\n" for name, digest in self.files)
        return hashlib.sha256(lines.encode(errors="surrogateescape")).hexdigest()


def content_of(files: Sequence[Path]) -> Content:
    """Read files, and all that is in folders; raises MtmError when one cannot be read."""
    return Content(tuple((name, _sha256(path)) for file in files for name, path in _named(file)))


def _named(file: Path) -> list[tuple[str, Path]]:
    if not file.is_dir():
        return [(file.name, file)]
    inside = sorted(path for path in file.rglob("*") if path.is_file())
    return [(path.relative_to(file).as_posix(), path) for path in inside]


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise MtmError(f"cannot read {path}: {error.strerror}; check its permissions, or copy it again") from error
