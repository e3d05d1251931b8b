"""The journal: writes what was commanded, tick by tick, in bounded space, so that it survives a crash.

A full or failing disk costs rows, which are counted, and never a tick. In real time a thread writes ten times a second
and has the disk confirm once a second, so a killed process loses a tenth of a second and a power cut about one.
"""

import io
import os
import threading
import time
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Self

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.journal_file import (
    NOISE,
    Event,
    JournalHeader,
    JournalRecord,
    PlayedSlot,
    event_line,
    heading,
    kept_segment,
    read_journal,
    segments,
    slot_line,
)

__all__ = ["Journal", "JournalHeader", "JournalRecord", "read_journal"]

DEFAULT_MAX_BYTES = 200_000_000  # about 11 hours at 50 Hz

_SEGMENTS = 8
_MOST_WAITING = 60_000
_INLINE_BATCH = 500
_WRITE_PERIOD_S = 0.1
_SYNC_PERIOD_S = 0.8  # with the writing period before it, within a second
# Events that each new segment repeats, so that the oldest segment may go without them.
_REPEATED_EVENTS = 50
_LONGEST_EVENT = 500  # characters
_Row = tuple[int, float, BodyVelocity, BodyVelocity, int, float]


class Journal:
    """Writes one run; `threaded` hands the writing to a thread, as real time needs, and else `append` does it.

    At most `max_bytes` are kept, in eight segments of which the oldest gives way. An existing journal is kept: the new
    one gets the next free number before its suffix, see `path`. Its owner alone can read it.
    With `hides_noise` it does not say what was sent in ticks with noise, which the key makes again from the slots that
    `played` is told. Raises MtmError when the file cannot be opened.
    """

    def __init__(
        self,
        path: Path,
        header: JournalHeader,
        *,
        threaded: bool,
        max_bytes: int = DEFAULT_MAX_BYTES,
        hides_noise: bool = False,
    ) -> None:
        self.hides_noise = hides_noise
        # Two counts, since two threads count.
        self._overrun = self._unwritten = 0
        self._header = header
        self._waiting: deque[_Row | Event | PlayedSlot] = deque()
        self._recent: deque[Event] = deque(maxlen=_REPEATED_EVENTS)
        self._slot: PlayedSlot | None = None
        self._segment_bytes = max_bytes // _SEGMENTS
        self._kept = self._size = 0
        self._torn = self._unsynced = False
        self._synced_s = time.monotonic()
        self.path, self._file = _open_new(path)
        self._write(heading(header))
        _sync_folder(self.path.parent)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True) if threaded else None
        if self._thread is not None:
            self._thread.start()

    @property
    def lost(self) -> int:
        """Rows and events that found the queue full or could not be written."""
        return self._overrun + self._unwritten

    def append(
        self, tick: int, now_s: float, base: BodyVelocity, sent: BodyVelocity, flags: int, late_s: float
    ) -> None:
        """Keep one tick for writing; a row that finds the queue full is lost and counted.

        `late_s` is from the instant that the loop waited for to `now_s`, with the ticks that it missed in between.
        """
        self._keep((tick, now_s, base, sent, flags, late_s))

    def note(self, tick: int, text: str) -> None:
        """Keep an event for writing, as `append` keeps a tick; may be called from any thread."""
        self._keep(Event(tick, text[:_LONGEST_EVENT]))

    def played(self, slot: PlayedSlot) -> None:
        """Keep for writing what is played from a tick on, as `append` keeps a tick."""
        self._keep(slot)

    def close(self) -> None:
        """Write what waits and close the file; safe to call more than once."""
        if self._file.closed:
            return
        if self._thread is not None:
            self._ending.set()
            self._thread.join()
        self._drain()
        self._sync()
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _keep(self, entry: _Row | Event | PlayedSlot) -> None:
        waiting = self._waiting
        if len(waiting) >= _MOST_WAITING:
            self._overrun += 1
            return
        waiting.append(entry)
        if self._thread is None and len(waiting) >= _INLINE_BATCH:
            self._drain()

    def _run(self) -> None:
        while not self._ending.wait(_WRITE_PERIOD_S):
            self._drain()
            if time.monotonic() - self._synced_s >= _SYNC_PERIOD_S:
                self._sync()

    def _drain(self) -> None:
        # In portions of a segment's size at most, however much has waited.
        while self._waiting:
            lines: list[bytes] = []
            slot = self._slot
            while self._waiting and len(lines) < _INLINE_BATCH:
                entry = self._waiting.popleft()
                lines.append(self._line(entry))
                if isinstance(entry, PlayedSlot):
                    slot = entry
            # A segment that begins with these lines repeats the slot that is under way in the first of them.
            self._write(b"".join(lines))
            self._slot = slot

    def _line(self, entry: _Row | Event | PlayedSlot) -> bytes:
        if isinstance(entry, PlayedSlot):
            return slot_line(entry)
        if isinstance(entry, Event):
            self._recent.append(entry)
            return event_line(entry)
        tick, now_s, base, sent, flags, late_s = entry
        speeds = ",".join(f"{value:.9g}" for value in base)
        # With the fixed schedule's waveforms another body could play the message.
        speeds += ",,," if self.hides_noise and flags & NOISE else "".join(f",{value:.9g}" for value in sent)
        return f"{tick},{now_s:.6f},{speeds},{late_s:.6f},{flags}\n".encode()

    def _write(self, text: bytes) -> None:
        if self._size and self._size + len(text) > self._segment_bytes and not self._rotate():
            self._unwritten += text.count(b"\n")
            return
        # After a write that was cut short the next one spoils its last line, which might look whole, and ends it.
        begun = b"!\n" if self._torn else b""
        try:
            done = self._file.write(begun + text)
        except OSError:
            done = 0
        self._size += done
        written = max(0, done - len(begun))
        self._unwritten += text[written:].count(b"\n")
        self._torn = done < len(begun + text) and (self._torn or done > 0)
        self._unsynced = True

    def _rotate(self) -> bool:
        """Go on in a new segment; False, and nothing changed but that old ones may be gone, when there is none."""
        kept = [segment for segment in segments(self.path) if segment != self.path]
        for oldest in kept[: max(0, len(kept) - (_SEGMENTS - 2))]:
            with suppress(OSError):
                oldest.unlink()
        self._sync()
        place = kept_segment(self.path, self._kept + 1)
        try:
            os.replace(self.path, place)
        except FileNotFoundError:
            pass  # somebody removed it, which is no reason to record no more
        except OSError:
            return False
        try:
            fresh = _open_private(self.path)
        except OSError:
            with suppress(OSError):
                os.replace(place, self.path)
            return False
        self._file.close()
        self._file, self._size, self._torn = fresh, 0, False
        self._kept += 1
        self._write(heading(self._header, self._recent) + (b"" if self._slot is None else slot_line(self._slot)))
        _sync_folder(self.path.parent)
        return True

    def _sync(self) -> None:
        self._synced_s = time.monotonic()
        if self._unsynced:
            self._unsynced = False
            # A disk that cannot confirm may still have written; what it did not write was counted by then.
            with suppress(OSError):
                os.fsync(self._file.fileno())


def _open_private(path: Path) -> io.FileIO:
    """A new file that its owner alone can read, whatever the umask: a journal tells what was said and when."""
    return io.FileIO(path, "xb", opener=lambda name, flags: os.open(name, flags, 0o600))


def _open_new(path: Path) -> tuple[Path, io.FileIO]:
    number = 1
    free = path
    while True:
        try:
            if not segments(free):
                return free, _open_private(free)
        except FileExistsError:
            pass  # it came between the look and the opening, or is no file at all
        except OSError as error:
            raise MtmError(f"cannot write the journal {free}: {error.strerror}; choose a folder that exists") from error
        number += 1
        free = path.with_stem(f"{path.stem}-{number}")


def _sync_folder(folder: Path) -> None:
    """Have the disk confirm the folder's entries, so that a new file is found after a power cut."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
