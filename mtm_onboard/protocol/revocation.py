"""The list of key files that are no longer trusted, such as a stolen robot's: public, in TOML, kept by the issuer."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.protocol.key import Key

_FORMAT = 1
_FIELDS = {"serial", "channels", "since"}
_HEADING = "# Key files that are no longer trusted. Not secret; whoever can change it can hide a theft.\n"


@dataclass(frozen=True)
class Revoked:
    """A file's serial, the channels that it can play (none for an auditor's), and since when it is not trusted."""

    serial: str
    channels: tuple[str, ...]
    since: datetime


@dataclass(frozen=True)
class RevocationList:
    """All that was revoked."""

    entries: tuple[Revoked, ...] = ()

    def check(self, key: Key) -> None:
        """Raise MtmError when the key's own file is on the list."""
        grant = key.holding.grant
        for entry in self.entries if grant is not None else ():
            if grant is not None and entry.serial == grant.serial:
                raise MtmError(
                    f"this key file, serial {entry.serial}, was revoked as of {_utc(entry.since)}; have another issued"
                )

    def channels(self, unix_s: float) -> tuple[str, ...]:
        """Channels that somebody else may play at that time, in the order of the list."""
        names = [name for entry in self.entries if entry.since.timestamp() <= unix_s for name in entry.channels]
        return tuple(dict.fromkeys(names))

    def with_entry(self, entry: Revoked) -> "RevocationList":
        """The list with one more; of a file that is on it already the earlier time counts."""
        others = [other for other in self.entries if other.serial != entry.serial]
        same = [other for other in self.entries if other.serial == entry.serial]
        since = min([entry.since, *(other.since for other in same)])
        channels = tuple(dict.fromkeys([*(name for other in same for name in other.channels), *entry.channels]))
        return RevocationList((*others, Revoked(entry.serial, channels, since)))


def load_revocations(path: Path) -> RevocationList:
    """Read a list; raises MtmError with one sentence that says what to change."""
    try:
        table = parsed_toml(read_text(path, "the revocation list"))
    except BrokenTextError as error:
        raise MtmError(
            f"{path} is no revocation list ({error}); name the file that mtm-onboard revoke wrote"
        ) from error
    entries = table.get("revoked", [])
    if table.get("format") != _FORMAT or table.keys() - {"format", "revoked"} or not isinstance(entries, list):
        raise MtmError(f"{path} is no revocation list of format {_FORMAT}; name the file that mtm-onboard revoke wrote")
    try:
        return RevocationList(tuple(_entry(entry) for entry in entries))
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def save_revocations(revocations: RevocationList, path: Path) -> None:
    """Write a list, whole or not at all, in the place of an older one."""
    lines = [_HEADING, f"format = {_FORMAT}\n"]
    for entry in revocations.entries:
        names = ", ".join(f'"{name}"' for name in entry.channels)
        lines.append(
            f'\n[[revoked]]\nserial = "{entry.serial}"\nchannels = [{names}]\nsince = {entry.since.isoformat()}\n'
        )
    with replacing(path) as temporary:
        temporary.write_text("".join(lines), encoding="utf-8")


def revoked_entry(serial: str, channels: tuple[str, ...], since: datetime) -> Revoked:
    """An entry; raises MtmError when the serial or a name cannot be one."""
    return _entry({"serial": serial, "channels": list(channels), "since": since})


def _entry(table: Any) -> Revoked:
    if not isinstance(table, dict) or table.keys() != _FIELDS:
        raise MtmError(f"an entry must have {', '.join(sorted(_FIELDS))} and nothing else; correct it")
    serial, channels, since = table["serial"], table["channels"], table["since"]
    if not isinstance(serial, str) or not re.fullmatch(r"[0-9a-f]{16}", serial):
        raise MtmError(f"the serial {serial!r} is not sixteen hexadecimal digits; mtm-onboard show names a file's")
    if not isinstance(since, datetime) or since.tzinfo is None:
        raise MtmError("since must be a date and time with its offset, such as 2026-12-31T00:00:00Z")
    if not isinstance(channels, list) or not all(
        isinstance(name, str) and name.isprintable() and '"' not in name and "\\" not in name for name in channels
    ):
        raise MtmError("channels must be a list of names; correct it")
    return Revoked(serial, tuple(channels), since)


def _utc(when: datetime) -> str:
    return f"{when.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"
