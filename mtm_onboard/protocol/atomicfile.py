"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError


@contextmanager
def replacing(path: Path, *, mode: int = 0o644) -> Iterator[Path]:
    """Yield a temporary path beside `path`, with its suffix; it takes the place of `path` when the block succeeds.

    An exception or an interrupt inside the block removes the temporary file and leaves whatever `path` held.
    Raises MtmError when the folder does not exist or cannot be written, or when `path` is a folder.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise MtmError(f"cannot write {path}: {error.strerror}; choose a folder that exists and is writable") from error
    os.close(handle)
    temporary = Path(name)
    try:
        os.chmod(temporary, mode)
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        _take_place(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _take_place(temporary: Path, path: Path) -> None:
    try:
        os.replace(temporary, path)
    except OSError as error:
        raise MtmError(f"cannot write {path}: {error.strerror}; name a file, not a folder") from error
