"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.secret_file import holds_secret


@contextmanager
def replacing(path: Path, *, mode: int = 0o644) -> Iterator[Path]:
    """Yield a temporary path beside `path`, with its suffix; it takes the place of `path` when the block succeeds.

    An exception or an interrupt inside the block removes the temporary file and leaves whatever `path` held.
    Whose file it replaces is the caller's to ask (see `output_file`), but it never replaces a key file. Raises MtmError
    for one, when the folder does not exist or cannot be written, and when `path` is a folder.
    """
    _spare_secret(path)
    with _temporary(path, mode) as temporary:
        yield temporary
        _confirm(temporary)
        # Again, since the work in the block may have taken hours.
        _spare_secret(path)
        _take_place(temporary, path)


@contextmanager
def _temporary(path: Path, mode: int) -> Iterator[Path]:
    """Yield an empty file beside `path`; an exception removes it."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise MtmError(f"cannot write {path}: {error.strerror}; choose a folder that exists and is writable") from error
    os.close(handle)
    temporary = Path(name)
    try:
        os.chmod(temporary, mode)
        yield temporary
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_new(path: Path, text: str, *, mode: int) -> None:
    """Write a file that must not exist yet, whole or not at all; of several that write it at once one succeeds.

    Raises MtmError when it exists, also as a link to nowhere, and as `replacing` does.
    """
    if os.path.lexists(path):
        raise _exists(path)
    with _temporary(path, mode) as temporary:
        temporary.write_text(text, encoding="utf-8")
        _confirm(temporary)
        try:
            # Unlike a look and a renaming, a link is made only where no name is.
            os.link(temporary, path)
        except FileExistsError as error:
            raise _exists(path) from error
        except OSError as error:
            raise MtmError(
                f"cannot write {path}: {error.strerror}; choose a folder of a disk that has links"
            ) from error
        temporary.unlink()


def _spare_secret(path: Path) -> None:
    if holds_secret(path):
        raise MtmError(f"{path} is a key file, and no command replaces one; choose another name")


def _exists(path: Path) -> MtmError:
    return MtmError(f"{path} exists already; choose another name or remove it first")


def _confirm(path: Path) -> None:
    with path.open("rb") as written:
        os.fsync(written.fileno())


def _take_place(temporary: Path, path: Path) -> None:
    try:
        os.replace(temporary, path)
    except OSError as error:
        raise MtmError(f"cannot write {path}: {error.strerror}; name a file, not a folder") from error
