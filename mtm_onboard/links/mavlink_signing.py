"""The key with which MAVLink 2 messages are signed: 64 hexadecimal digits in a file that its owner alone can read."""

import os
import re
import time
from pathlib import Path
from typing import Final

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened

KEY_BYTES: Final = 32

# Signatures count units of ten microseconds from the beginning of 2015.
_EPOCH_UNIX_S: Final = 1_420_070_400
_UNITS_PER_S: Final = 100_000


def load_signing_key(path: Path) -> bytes:
    """Read the key; raises MtmError, which never shows what the file holds."""
    with opened(path, "the signing key") as file:
        mode, text = os.fstat(file.fileno()).st_mode, file.read(4 * KEY_BYTES)
    if mode & 0o077:
        raise MtmError(f"the signing key {path} can be read by others (mode {mode & 0o777:04o}); run: chmod 600 {path}")
    if not re.fullmatch(rb"\s*[0-9a-fA-F]{%d}\s*" % (2 * KEY_BYTES), text):
        raise MtmError(f"{path} is no signing key; it must hold {2 * KEY_BYTES} hexadecimal digits and nothing else")
    return bytes.fromhex(text.decode())


def signing_timestamp(unix_s: float | None = None) -> int:
    """The signature's time of this instant, or of `unix_s`."""
    return int(((time.time() if unix_s is None else unix_s) - _EPOCH_UNIX_S) * _UNITS_PER_S)
