"""Whether what is drawn can be written, said before the long work."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError, WrongValueError


def check_output_path(path: Path, suffixes: Sequence[str], what: str = "picture") -> None:
    """Raise MtmError unless a file whose name ends in one of the `suffixes` can be written to `path`."""
    if path.suffix.lower() not in suffixes:
        raise WrongValueError(f"{path} is no {what} format that can be drawn; end the name in {', '.join(suffixes)}")
    if path.is_dir():
        raise MtmError(f"{path} is a folder; name a file for the {what}")
    try:
        handle, probe = tempfile.mkstemp(prefix=f".{path.stem}-", dir=path.parent)
    except OSError as error:
        raise MtmError(f"cannot write {path}: {error.strerror}; choose a folder that exists and is writable") from error
    os.close(handle)
    os.unlink(probe)
