"""The ledger: what a robot must remember from run to run, so that no slot is played twice and numbers go on.

A small TOML file beside the journal, written anew each time: for each key the last message slot that may have been
played, and the number of the next message. It holds no secret.
"""

import fcntl
import os
import threading
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text

_FORMAT = 1
_FIELDS = {"id", "fingerprint", "last_slot", "next_number"}
_HEADING = "# What mtm-onboard run remembers of a robot's messages, so that no waveform is played twice. Keep it.\n"


@dataclass(frozen=True)
class _Entry:
    """One key's: slots up to `last_slot` may have been played (-1: none), and no message has `next_number` yet."""

    id: str
    fingerprint: str
    last_slot: int = -1
    next_number: int = 0


class Ledger:
    """The entry of one key in a ledger file, which is locked while it is open; any thread may use it.

    Raises MtmError when the file cannot be written or is damaged, and when another run has it open.
    """

    def __init__(self, path: Path, key_id: str, fingerprint: str) -> None:
        self._path = path
        self._lock = _locked(path)
        # The thread that keeps slots and the operator's, who takes numbers.
        self._one_at_a_time = threading.Lock()
        try:
            entries = _read(path)
            self._own = next(
                (entry for entry in entries if (entry.id, entry.fingerprint) == (key_id, fingerprint)),
                _Entry(key_id, fingerprint),
            )
            self._others = [entry for entry in entries if entry != self._own]
            # What cannot be written is found here, and not when a slot begins.
            self._write(self._own)
        except BaseException:
            os.close(self._lock)
            raise

    @property
    def last_slot(self) -> int:
        """The last slot that may have been played; -1 for none."""
        return self._own.last_slot

    def reserve(self, slot: int) -> None:
        """Have the disk keep that slots up to this one may have been played; raises MtmError when it does not."""
        with self._one_at_a_time:
            if slot > self._own.last_slot:
                self._write(replace(self._own, last_slot=slot))

    def release(self, slot: int) -> None:
        """Say that slots after this one were not played after all; raises MtmError as `reserve` does."""
        with self._one_at_a_time:
            if slot < self._own.last_slot:
                self._write(replace(self._own, last_slot=slot))

    def take_number(self) -> int:
        """The number of the next message, which no other message will have; raises MtmError as `reserve` does."""
        with self._one_at_a_time:
            number = self._own.next_number
            self._write(replace(self._own, next_number=number + 1))
        return number

    def close(self) -> None:
        """Let another run have the file; safe to call more than once."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, own: _Entry) -> None:
        lines = [_HEADING, f"format = {_FORMAT}\n"]
        for entry in [*self._others, own]:
            lines.append(
                f'\n[[keys]]\nid = "{entry.id}"\nfingerprint = "{entry.fingerprint}"\nlast_slot = {entry.last_slot}\n'
                f"next_number = {entry.next_number}\n"
            )
        try:
            with replacing(self._path, mode=0o600) as temporary:
                temporary.write_text("".join(lines), encoding="utf-8")
            _confirm_folder(self._path.parent)
        except OSError as error:
            raise MtmError(f"cannot write {self._path}: {error.strerror}; make room on its disk") from error
        self._own = own


def _locked(path: Path) -> int:
    """A descriptor that holds the lock; the lock's file stays, since removing it would let two runs in."""
    name = path.with_name(f"{path.name}.lock")
    try:
        lock = os.open(name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise MtmError(f"cannot write {name}: {error.strerror}; choose a folder that exists and is writable") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        raise MtmError(f"another run has {path} open, and would play the same slots; end it first") from error
    return lock


def _read(path: Path) -> list[_Entry]:
    if not path.exists():
        return []
    try:
        table = parsed_toml(read_text(path, "the ledger"))
        return _entries(table)
    except BrokenTextError as error:
        raise MtmError(
            f"{path} is damaged ({error}), so it is not known which slots were played; take another key, or remove it "
            "when the clock was never ahead"
        ) from error


def _entries(table: dict[str, Any]) -> list[_Entry]:
    keys = table.get("keys", [])
    if table.get("format") != _FORMAT or not isinstance(keys, list):
        raise BrokenTextError(f"it is not of format {_FORMAT}")
    return [_entry(entry) for entry in keys]


def _entry(table: Any) -> _Entry:
    if not isinstance(table, dict) or table.keys() != _FIELDS:
        raise BrokenTextError("an entry lacks a field, or has one too many")
    texts, numbers = (table["id"], table["fingerprint"]), (table["last_slot"], table["next_number"])
    if not all(type(text) is str and text.isprintable() and '"' not in text and "\\" not in text for text in texts):
        raise BrokenTextError("an entry's names are not text")
    if not all(type(number) is int and number >= -1 for number in numbers):
        raise BrokenTextError("an entry's numbers are none")
    return _Entry(**table)


def _confirm_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
