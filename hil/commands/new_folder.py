"""New folders that appear complete or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mtm_onboard.protocol import MtmError


def check_new(path: Path) -> None:
    """Raise MtmError when there is something at `path`; meant for the time before the long work."""
    if path.exists() or path.is_symlink():
        raise MtmError(f"{path} exists already; choose another folder or remove it first")


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `path` that becomes `path` when the block succeeds.

    An exception or an interrupt inside the block removes it. Folders above `path` are made where they are missing.
    Raises MtmError when `path` exists or cannot be made.
    """
    check_new(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
    except OSError as error:
        raise MtmError(f"cannot make {path}: {error.strerror}; choose a folder that is writable") from error
    try:
        yield temporary
        temporary.chmod(0o755)
        _take_place(temporary, path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _take_place(temporary: Path, path: Path) -> None:
    try:
        os.rename(temporary, path)
    except OSError as error:
        raise MtmError(f"{path} was made by somebody else meanwhile; choose another folder") from error
