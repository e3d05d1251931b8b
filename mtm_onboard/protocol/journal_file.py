"""The journal's file: what was commanded, tick by tick, as comma-separated text.

The first line is `# ` and the header in JSON, the second names the columns, and each further line is a tick or, after
`# `, an event in JSON. A long run is a row of such files, its segments: `robot.csv` is being written, those numbered
from `robot.csv.000001` on came before it, and the oldest may have been removed. Each segment begins with the header and
with the run's latest events, so that it can be read alone.
"""

import glob
import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import opened

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Bits of a row's flags. UNSENT: the link took the command of this tick nowhere. HELD: the link is down, or no base
# command has come since it came back.
NOISE, STALE, STOPPED, CLAMPED, REFUSED, HELD, UNSENT = 1, 2, 4, 8, 16, 32, 64

COLUMNS = (
    "tick", "time_s", "base_vx_mps", "base_vy_mps", "base_wz_radps", "sent_vx_mps", "sent_vy_mps", "sent_wz_radps",
    "lateness_s", "flags",
)  # fmt: skip
_SENT = slice(5, 8)
_NUMBER_DIGITS = 6

# What no run writes: beyond every clock, speed and tick, beyond the alphabets, and beyond the year 9999.
_LARGEST_NUMBER = 1e12
_LARGEST_SYMBOL = 65_535
_LATEST_UNIX_S = 253_402_300_799.0
# A tick's row has a time within that tick.
_MOST_OFF_TICKS = 2.0


@dataclass(frozen=True, kw_only=True)
class JournalHeader:
    """What the rows belong to. `symbols` is the whole message, None when only base commands were sent.

    `start_s` is tick 0 on the runtime's clock and `start_unix_s` the same instant in seconds since the Unix epoch,
    None in simulated time. The secret is not here.
    """

    fingerprint: str
    key_id: str
    robot: str
    channel: str
    symbols: tuple[int, ...] | None
    repeat: bool
    rate_hz: float
    start_s: float
    start_unix_s: float | None


@dataclass(frozen=True)
class Event:
    """Something that happened once, in one sentence, at the tick that was next or under way."""

    tick: int
    text: str


@dataclass(frozen=True)
class PlayedSlot:
    """One time the message was played: from which tick on, in which slot, and the channel's own symbols.

    `slot` is the message slot whose waveforms it has, counted since the Unix epoch under the rolling schedule.
    """

    first_tick: int
    slot: int
    symbols: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class JournalRecord:
    """A journal read back: n rows. `base` and `sent` are (n, 3): vx, vy in m/s and wz in rad/s.

    `flags` are the bits above; `damaged` counts lines that could not be read. `sent` is NaN where the journal does not
    say it: in ticks with noise, which `journal_noise.with_noise` makes again with the key, from `slots`.
    """

    header: JournalHeader
    ticks: Integers
    times_s: Floats
    base: Floats
    sent: Floats
    lateness_s: Floats
    flags: Integers
    damaged: int
    events: tuple[Event, ...] = ()
    slots: tuple[PlayedSlot, ...] = ()

    @property
    def noise(self) -> Floats:
        """What was added to the base command and reached the link, shape (n, 3).

        Zero in ticks that were not sent, NaN where `sent` is.
        """
        reached = (self.flags & UNSENT) == 0
        noise: Floats = np.where(reached[:, None], self.sent - self.base, 0.0)
        return noise


def heading(header: JournalHeader, events: Iterable[Event] = ()) -> bytes:
    """The lines that a segment begins with."""
    first = f"# {json.dumps(asdict(header))}\n{','.join(COLUMNS)}\n"
    return first.encode() + b"".join(map(event_line, events))


def event_line(event: Event) -> bytes:
    """One event as a line."""
    return f"# {json.dumps(asdict(event))}\n".encode()


def slot_line(slot: PlayedSlot) -> bytes:
    """A slot that was played as a line."""
    return f"# {json.dumps(asdict(slot))}\n".encode()


def segments(path: Path) -> list[Path]:
    """The files of the journal `path`, oldest first; empty when there is none."""
    kept = [
        other
        for other in path.parent.glob(f"{glob.escape(path.name)}.*")
        if len(number := other.name[len(path.name) + 1 :]) == _NUMBER_DIGITS and number.isdecimal()
    ]
    return sorted(kept) + ([path] if path.exists() else [])


def kept_segment(path: Path, number: int) -> Path:
    """The name under which the segment `number` of `path`, counted from 1, is kept."""
    return path.with_name(f"{path.name}.{number:0{_NUMBER_DIGITS}d}")


def read_journal(path: Path) -> JournalRecord:
    """Read all segments of a journal; lines that a full disk or a crash left damaged are skipped and counted.

    Raises MtmError when a file cannot be read or none has a header.
    """
    header: JournalHeader | None = None
    tables: list[Floats] = []
    events: dict[Event, None] = {}
    slots: dict[PlayedSlot, None] = {}
    damaged = 0
    for segment in segments(path) or [path]:
        with opened(segment, "the journal") as file:
            content = _content(file.read().decode("utf-8", errors="replace").split("\n"))
        header = content.header or header
        tables.append(content.rows)
        events.update(dict.fromkeys(content.events))
        slots.update(dict.fromkeys(content.slots))
        damaged += content.damaged
    if header is None:
        raise MtmError(f"{path} does not begin like a journal; name a file that mtm-onboard run wrote")
    columns = np.concatenate(tables)
    # A digit too many in a tick's number would else stand for years without a row.
    off_ticks = (columns[:, 1] - header.start_s) * header.rate_hz - columns[:, 0]
    sound = np.abs(off_ticks) <= _MOST_OFF_TICKS
    damaged += int(np.count_nonzero(~sound))
    columns = columns[sound]
    return JournalRecord(
        header=header,
        ticks=columns[:, 0].astype(np.int64),
        times_s=columns[:, 1],
        base=columns[:, 2:5],
        sent=columns[:, 5:8],
        lateness_s=columns[:, 8],
        flags=columns[:, 9].astype(np.int64),
        damaged=damaged,
        events=tuple(events),
        slots=tuple(slots),
    )


@dataclass(frozen=True)
class _Content:
    """What one segment holds; `rows` (n, columns)."""

    header: JournalHeader | None
    rows: Floats
    events: list[Event]
    slots: list[PlayedSlot]
    damaged: int


def _content(lines: list[str]) -> _Content:
    header, rows, events, slots, damaged = None, [], [], [], int(bool(lines[-1]))
    names = ",".join(COLUMNS)
    for line in lines[:-1]:
        if line.startswith("#"):
            table = _table(line)
            event, begun, slot = _event(table), _header(table), _slot(table)
            if event is not None:
                events.append(event)
            if slot is not None:
                slots.append(slot)
            damaged += event is None and begun is None and slot is None
            header = begun or header
        elif (row := _numbers(line)) is not None:
            rows.append(row)
        elif line and line != names:
            damaged += 1
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS))
    ticks, flags = columns[:, 0], columns[:, -1]
    # NaN is in no range; a tick with noise may leave out what was sent.
    sent = columns[:, _SENT]
    in_range = np.abs(columns) <= _LARGEST_NUMBER
    noisy = np.mod(np.where(in_range[:, -1], flags, 0.0), 2 * NOISE) >= NOISE
    left_out = np.all(np.isnan(sent), axis=1) & noisy
    in_range[:, _SENT] |= left_out[:, None]
    sound = np.all(in_range, axis=1) & (np.floor(ticks) == ticks)
    sound &= (flags >= 0) & (flags < 2 * UNSENT) & (np.floor(flags) == flags)
    return _Content(header, columns[sound], events, slots, damaged + int(np.count_nonzero(~sound)))


def _header(table: dict[str, Any]) -> JournalHeader | None:
    try:
        symbols = table["symbols"]
        header = JournalHeader(**table | {"symbols": None if symbols is None else tuple(symbols)})
    except (TypeError, KeyError):
        return None
    texts = (header.fingerprint, header.key_id, header.robot, header.channel)
    symbols_fit = all(_is_whole(symbol, 0, _LARGEST_SYMBOL) for symbol in header.symbols or ())
    rate_fits = _is_number(header.rate_hz, 0.0, _LARGEST_NUMBER) and header.rate_hz > 0
    starts_fit = _is_number(header.start_s, -_LARGEST_NUMBER, _LARGEST_NUMBER) and (
        header.start_unix_s is None or _is_number(header.start_unix_s, 0.0, _LATEST_UNIX_S)
    )
    fits = all(map(_is_text, texts)) and isinstance(header.repeat, bool) and symbols_fit and rate_fits and starts_fit
    return header if fits else None


def _event(table: dict[str, Any]) -> Event | None:
    tick, text = table.get("tick"), table.get("text")
    largest = int(_LARGEST_NUMBER)
    return Event(tick, text) if _is_whole(tick, -largest, largest) and _is_text(text) else None


def _slot(table: dict[str, Any]) -> PlayedSlot | None:
    if table.keys() != {"first_tick", "slot", "symbols"}:
        return None
    first_tick, slot, symbols = table["first_tick"], table["slot"], table["symbols"]
    largest = int(_LARGEST_NUMBER)
    fits = _is_whole(first_tick, -largest, largest) and _is_whole(slot, 0, largest) and isinstance(symbols, list)
    if not fits or not all(_is_whole(symbol, 0, _LARGEST_SYMBOL) for symbol in symbols):
        return None
    return PlayedSlot(first_tick, slot, tuple(symbols))


def _is_whole(value: Any, low: int, high: int) -> TypeGuard[int]:
    return type(value) is int and low <= value <= high


def _is_number(value: Any, low: float, high: float) -> bool:
    return type(value) in (int, float) and low <= value <= high


def _is_text(value: Any) -> TypeGuard[str]:
    """Text that can be written out, which half of a surrogate pair cannot."""
    return isinstance(value, str) and value == value.encode("utf-8", "replace").decode()


def _table(line: str) -> dict[str, Any]:
    """The JSON object after `# `; empty when there is none."""
    try:
        table = json.loads(line.removeprefix("# "))
    except (ValueError, RecursionError):
        return {}
    return table if isinstance(table, dict) else {}


def _numbers(line: str) -> list[float] | None:
    try:
        numbers = [float(field) if field else math.nan for field in line.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == len(COLUMNS) else None
