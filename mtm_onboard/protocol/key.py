"""The key file: a secret and the scheme it was provisioned for, in TOML, readable by its owner alone."""

import os
import re
import secrets
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.atomicfile import write_new
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, decoded, opened, parsed_toml
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.scheme import Scheme, scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

KEY_FORMAT = 1
_FIELDS = {"format", "id", "secret", "scheme"}


@dataclass(frozen=True)
class Key:
    """A named secret and its scheme. The secret never appears in `repr`, logs or error texts."""

    id: str
    secret: bytes = field(repr=False)
    scheme: Scheme

    def codebook(self, first_slot: int = 0) -> Codebook:
        """All waveforms of this key, with windows counted from message slot `first_slot` on."""
        return Codebook(self.secret, self.scheme, first_slot)


def generate_key(key_id: str, scheme: Scheme) -> Key:
    """A key with a fresh secret from the operating system's generator."""
    _check_id(key_id)
    return Key(key_id, secrets.token_bytes(SECRET_BYTES), scheme)


def _check_id(key_id: object) -> None:
    if not isinstance(key_id, str) or not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", key_id):
        raise MtmError(
            f"the key id {key_id!r} is not usable; take 1 to 64 letters, digits, dots, dashes or underscores"
        )


def save_key(key: Key, path: Path) -> None:
    """Write the key file with mode 0600, whole or not at all; an existing file is refused, never overwritten."""
    write_new(path, key_text(key), mode=0o600)


def key_text(key: Key) -> str:
    """The key file's text, secret included."""
    return f'format = {KEY_FORMAT}\nid = "{key.id}"\nsecret = "{key.secret.hex()}"\n\n{scheme_text(key.scheme)}'


def load_key(path: Path) -> Key:
    """Read a key file; raises MtmError with one sentence that says what to change."""
    table = _read_private_toml(path)
    unknown = sorted(table.keys() - _FIELDS)
    if unknown:
        raise MtmError(f"{path} has an unknown field {unknown[0]!r}; remove it or correct its spelling")
    if table.get("format") is True or table.get("format") != KEY_FORMAT:
        raise MtmError(
            f"{path} is of key format {table.get('format')!r}, this program reads {KEY_FORMAT}; provision it anew"
        )
    missing = sorted(_FIELDS - table.keys())
    if missing:
        raise MtmError(f"{path} lacks {', '.join(missing)}; it may be cut off, so provision it anew")
    if not isinstance(table["scheme"], dict):
        raise MtmError(f"{path}: the scheme must be a table ([scheme]); provision it anew")
    try:
        _check_id(table["id"])
        scheme = scheme_from_table(table["scheme"])
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error
    return Key(table["id"], _secret(table["secret"], path), scheme)


def _secret(text: Any, path: Path) -> bytes:
    digits = 2 * SECRET_BYTES
    if not isinstance(text, str) or not re.fullmatch(rf"[0-9a-fA-F]{{{digits}}}", text):
        length = len(text) if isinstance(text, str) else "no"
        raise MtmError(f"{path}: the secret must be {digits} hexadecimal digits, and this one is {length} characters "
                       "or holds others; provision it anew")  # fmt: skip
    return bytes.fromhex(text)


def _read_private_toml(path: Path) -> dict[str, Any]:
    try:
        with opened(path, "the key file") as file:
            mode = os.fstat(file.fileno()).st_mode
            if mode & 0o077:
                raise MtmError(f"{path} can be read by others (mode {mode & 0o777:04o}); run: chmod 600 {path}")
            return parsed_toml(decoded(file, path))
    except BrokenTextError:
        # The parser's message may quote the line, and the line may hold the secret: neither is told, nor is the cause.
        raise MtmError(f"{path} is not valid TOML; name the file that mtm-onboard keygen wrote") from None
