"""Which files hold a secret of ours, told from what is in them, so that nothing is ever written over one."""

import os
import re
import stat
from pathlib import Path

from mtm_onboard.protocol.input_file import LARGEST_TEXT_BYTES

# By the fields of key files, which a file that was cut off or edited still has; a device's key is its digits alone.
_SECRET = re.compile(
    rb"""^\s*(?:secret|day_secrets|channel_secrets|tags_secrets)\s*=|^\s*(?:link|anchor)\s*=\s*["'][0-9a-fA-F]{64}|"""
    rb"""\A\s*[0-9a-fA-F]{64}\s*\Z""",
    re.MULTILINE,
)

# Fields of key files of every kind, so that what is damaged or written by hand is still taken for one.
_KEY_FIELD = re.compile(rb"^\s*(?:format|id|kind|serial|secret)\s*=|^\s*\[scheme\]", re.MULTILINE)


def looks_like_key(data: bytes) -> bool:
    """Whether a file that begins so may have been meant as a key file: text with any of its fields."""
    return b"\0" not in data and _KEY_FIELD.search(data) is not None


def holds_secret(path: Path) -> bool:
    """Whether the file at `path` is a key file of any kind, whole or damaged; one that cannot be read counts as one.

    False where there is no file; pictures, tables and other files are none, whatever their names.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    except (OSError, ValueError):
        return True
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        return False
    with os.fdopen(descriptor, "rb") as file:
        data = file.read(LARGEST_TEXT_BYTES)
    return b"\0" not in data and _SECRET.search(data) is not None
