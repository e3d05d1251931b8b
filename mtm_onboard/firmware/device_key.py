"""The key of a device that plays images: not the fleet's, so that a device taken apart shows no message's key."""

import os
import re
import secrets
from pathlib import Path

from mtm_onboard.protocol.atomicfile import write_new
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, decoded, opened
from mtm_onboard.protocol.keystream import SECRET_BYTES


def new_device_key(path: Path) -> None:
    """Write a fresh key as 64 hexadecimal digits with mode 0600; the file must not exist."""
    write_new(path, secrets.token_bytes(SECRET_BYTES).hex() + "\n", mode=0o600)


def load_device_key(path: Path) -> bytes:
    """The key in a file; raises MtmError when it is none or others can read it."""
    try:
        with opened(path, "the device key") as file:
            mode = os.fstat(file.fileno()).st_mode
            if mode & 0o077:
                raise MtmError(f"{path} can be read by others (mode {mode & 0o777:04o}); run: chmod 600 {path}")
            text = decoded(file, path).strip()
    except BrokenTextError as error:
        raise MtmError(f"{path} is no device key; name the file that mtm-onboard device-key wrote") from error
    if not re.fullmatch(rf"[0-9a-f]{{{2 * SECRET_BYTES}}}", text):
        raise MtmError(f"{path} is no device key; name the file that mtm-onboard device-key wrote")
    return bytes.fromhex(text)
