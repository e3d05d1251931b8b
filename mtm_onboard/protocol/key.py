"""The key file: secrets and the scheme they were provisioned for, in TOML, readable by its owner alone."""

import os
import re
import secrets
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.atomicfile import write_new
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError, WrongValueError
from mtm_onboard.protocol.holding import Holding, Secret, holding_of
from mtm_onboard.protocol.holding_file import MOST_DAYS, holding_from_table, holding_text
from mtm_onboard.protocol.input_file import LARGEST_TEXT_BYTES, BrokenTextError, decoded, opened, parsed_toml
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import USUAL_DAYS, new_master
from mtm_onboard.protocol.scheme import Scheme, scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text
from mtm_onboard.protocol.secret_file import looks_like_key

# Format 1 has one secret for everything, format 2 a part of the key tree.
KEY_FORMATS = (1, 2)
_FIELDS = {"format", "id", "secret", "scheme"}


@dataclass(frozen=True)
class Key:
    """A named secret, or what a file of format 2 holds, and its scheme. No secret is ever in `repr`, logs or errors."""

    id: str
    secret: Secret = field(repr=False)
    scheme: Scheme

    @property
    def holding(self) -> Holding:
        """The secrets that it gives, by epoch and channel."""
        return holding_of(self.secret)

    @property
    def warning(self) -> str | None:
        """What whoever uses this key should know of it, in one sentence; None when there is nothing."""
        grant = self.holding.grant
        if grant is None:
            return (
                f"key {self.id} is of format 1: whoever has it can read and forge the messages of all robots and days; "
                "mtm-onboard keygen and issue make keys of format 2"
            )
        if grant.kind == "master":
            return (
                f"key {self.id} is a master, which can read and forge everything; keep it apart, and use files that "
                "mtm-onboard issue cuts from it"
            )
        return None

    def codebook(self, first_slot: int = 0) -> Codebook:
        """All waveforms of this key, with windows counted from message slot `first_slot` on."""
        return Codebook(self.secret, self.scheme, first_slot)


def generate_key(key_id: str, scheme: Scheme) -> Key:
    """A key with a fresh secret from the operating system's generator.

    Under the rolling schedule it is a master of format 2 for ten years from today, under the fixed one of format 1.
    """
    _check_id(key_id)
    if scheme.schedule == "rolling":
        return generate_master(key_id, scheme, datetime.now(UTC).date(), USUAL_DAYS)
    return Key(key_id, secrets.token_bytes(SECRET_BYTES), scheme)


def generate_master(key_id: str, scheme: Scheme, first_day: date, days: int) -> Key:
    """A master of format 2 for so many days; raises MtmError when the schedule is fixed or there are too many days."""
    _check_id(key_id)
    if scheme.schedule != "rolling":
        raise MtmError('keys of format 2 have a day\'s key for each day; make the schedule "rolling"')
    if not 1 <= days <= MOST_DAYS:
        raise WrongValueError(f"a key is for 1 to {MOST_DAYS} days, not {days}; give fewer")
    return Key(key_id, new_master(key_id, scheme, first_day, days), scheme)


def _check_id(key_id: object) -> None:
    if not isinstance(key_id, str) or not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", key_id):
        raise WrongValueError(
            f"the key id {key_id!r} is not usable; take 1 to 64 letters, digits, dots, dashes or underscores"
        )


def save_key(key: Key, path: Path) -> None:
    """Write the key file with mode 0600, whole or not at all; an existing file is refused, never overwritten."""
    text = key_text(key)
    if len(text) > LARGEST_TEXT_BYTES:
        raise MtmError(f"the key file would have {len(text)} bytes, and {LARGEST_TEXT_BYTES} are read; give fewer days")
    write_new(path, text, mode=0o600)


def key_text(key: Key) -> str:
    """The key file's text, secrets included."""
    if isinstance(key.secret, bytes):
        return f'format = 1\nid = "{key.id}"\nsecret = "{key.secret.hex()}"\n\n{scheme_text(key.scheme)}'
    return f'format = 2\nid = "{key.id}"\n{holding_text(key.secret)}\n\n{scheme_text(key.scheme)}'


def load_key(path: Path) -> Key:
    """Read a key file; raises MtmError with one sentence that says what to change."""
    table = _read_private_toml(path)
    if table.get("format") == 1 and table.get("format") is not True:
        unknown = sorted(table.keys() - _FIELDS)
        if unknown:
            raise MtmError(f"{path} has an unknown field {unknown[0]!r}; remove it or correct its spelling")
    elif type(table.get("format")) is not int or table.get("format") not in KEY_FORMATS:
        raise MtmError(
            f"{path} is of key format {table.get('format')!r}, this program reads 1 and 2; provision it anew"
        )
    missing = sorted({"id", "scheme"} - table.keys() if table["format"] == 2 else _FIELDS - table.keys())
    if missing:
        raise MtmError(f"{path} lacks {', '.join(missing)}; it may be cut off, so provision it anew")
    if not isinstance(table["scheme"], dict):
        raise MtmError(f"{path}: the scheme must be a table ([scheme]); provision it anew")
    try:
        _check_id(table["id"])
        scheme = scheme_from_table(table["scheme"])
        held = holding_from_table(table, scheme) if table["format"] == 2 else None
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error
    return Key(table["id"], _secret(table["secret"], path) if held is None else held, scheme)


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
            # What is no key file need not be kept from others, so this comes first.
            if not looks_like_key(file.read(LARGEST_TEXT_BYTES)):
                raise MtmError(f"{path} is no key file; name the file that mtm-onboard keygen or issue wrote")
            file.seek(0)
            mode = os.fstat(file.fileno()).st_mode
            if mode & 0o077:
                raise MtmError(f"{path} can be read by others (mode {mode & 0o777:04o}); run: chmod 600 {path}")
            return parsed_toml(decoded(file, path))
    except BrokenTextError:
        # The parser's message may quote the line, and the line may hold the secret: neither is told, nor is the cause.
        raise MtmError(f"{path} is not valid TOML; name the file that mtm-onboard keygen wrote") from None
