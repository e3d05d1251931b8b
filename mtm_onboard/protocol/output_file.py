"""Files that commands write: what stands in their place is theirs, or stays.

Each file that a command makes carries the command's mark, and only a file with its mark is replaced. Text has it in its
first line (`# mtm-audit plan ...`); pictures, films, pages and documents carry `mark_of` the command as the program
that made them, which is a field of each of those formats.
"""

import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened
from mtm_onboard.protocol.secret_file import holds_secret

# How files begin whose mark is a field somewhere near their beginning or end: PNG, PDF, SVG, HTML, and MP4, whose first
# box has its length before its name.
_HEADS = (b"\x89PNG\r\n\x1a\n", b"%PDF-", b"<?xml", b"<!doctype html", b"<!DOCTYPE html")
_MP4_BOX = b"ftyp"
# The index of an hour's film, behind which its fields stand, has fewer.
_SEARCHED_BYTES = 4_000_000
_PNG_HEAD_BYTES = 33


def mark_of(command: str) -> str:
    """What pictures, films, pages and documents name as their maker, such as "made by mtm-audit plan"."""
    return f"made by {command}"


def heading_of(command: str) -> str:
    """The first line of a text file that a command makes, unless it begins with its whole command line."""
    return f"# {command}\n"


def marked_png(png: bytes, command: str) -> bytes:
    """A PNG file's bytes with the mark, for encoders that write no fields."""
    field = b"Software\0" + mark_of(command).encode("latin-1")
    chunk = len(field).to_bytes(4, "big") + b"tEXt" + field + zlib.crc32(b"tEXt" + field).to_bytes(4, "big")
    return png[:_PNG_HEAD_BYTES] + chunk + png[_PNG_HEAD_BYTES:]


def check_outputs(command: str, *paths: Path | None, force: bool = False, begins: tuple[bytes, ...] = ()) -> None:
    """Refuse, before any work, to write to what `command` did not make; None among `paths` is an option not given.

    A file counts as the command's own when it carries its mark, when it begins with one of `begins` (the header of a
    table without comments, the magic number of a format that this command alone writes), and when it is empty. With
    `force` any file may be replaced but a key file, which never may. Raises MtmError that says what to do, also when
    two paths are the same, or a folder is missing or cannot be written.
    """
    given = [path for path in paths if path is not None]
    for path in given:
        if sum(os.path.abspath(path) == os.path.abspath(other) for other in given) > 1:
            raise MtmError(f"{path} is named for two results; give each a name of its own")
        _check(path, command, force, begins)


@contextmanager
def output_file(
    path: Path, command: str, *, force: bool = False, begins: tuple[bytes, ...] = (), mode: int = 0o644
) -> Iterator[Path]:
    """Yield a temporary path beside `path` that takes its place when the block succeeds, as `replacing` does.

    The block writes the command's mark into it. Raises MtmError as `check_outputs` and `replacing` do.
    """
    check_outputs(command, path, force=force, begins=begins)
    with replacing(path, mode=mode) as temporary:
        yield temporary


def check_new_file(path: Path) -> None:
    """Refuse, before any work, to write a file that exists, or into a folder that does not or cannot be written."""
    _check_folder(path)
    if os.path.lexists(path):
        raise MtmError(f"{path} exists already; choose another name or remove it first")


def _check_folder(path: Path) -> None:
    folder = path.parent
    if not folder.is_dir():
        raise MtmError(f"cannot write {path}: there is no folder {folder}; choose a folder that exists")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise MtmError(f"cannot write {path}: the folder {folder} is not yours to write; choose another")


def _check(path: Path, command: str, force: bool, begins: tuple[bytes, ...]) -> None:
    _check_folder(path)
    if not os.path.lexists(path):
        return
    if not path.exists():
        raise MtmError(f"{path} is a link to nothing; remove it, or choose another name")
    if not stat.S_ISREG(path.stat().st_mode):
        raise MtmError(f"cannot write {path}: it is a folder, pipe or device; name a file")
    if holds_secret(path):
        raise MtmError(f"{path} is a key file, and no command replaces one; choose another name")
    if not force and not _is_made_by(path, command, begins):
        raise MtmError(f"{path} exists and was not made by {command}; choose another name, or replace it with --force")


def _is_made_by(path: Path, command: str, begins: tuple[bytes, ...]) -> bool:
    with opened(path, "the file to replace") as file:
        head = file.read(_SEARCHED_BYTES)
        size = file.seek(0, os.SEEK_END)
        file.seek(max(len(head), size - _SEARCHED_BYTES))
        tail = file.read()
    if not head or head.startswith(begins):
        return True
    if head.startswith(_HEADS) or head[4:8] == _MP4_BOX:
        mark = mark_of(command).encode("latin-1")
        return mark in head or mark in tail
    # Behind the name comes the rest of the command line, a comment or nothing, and never more of a longer name.
    first = head.partition(b"\n")[0].rstrip()
    made = f"# {command}".encode()
    return first == made or first.startswith((made + b" ", made + b":"))
