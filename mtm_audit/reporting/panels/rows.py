"""The rows that panels share: one a place of the message or a channel, with what became of it."""

import math
from dataclasses import dataclass

import numpy as np

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.track import Floats


@dataclass(frozen=True)
class Row:
    """`note` says what a reader of the row must know, such as "unseen"; empty when the channel was read as named.

    `scores` (M,) are NaN where nothing was read; `symbol` is what was read for certain, None otherwise. `is_sure` is
    None where a frame's check and not a single symbol decides.
    """

    name: str
    note: str
    scores: Floats
    symbol: int | None
    is_sure: bool | None


def channel_note(item: ChannelDecoding, decoding: Decoding) -> str:
    """What became of a channel: unseen, silent, too short, in another track than names say; empty when just read.

    Without a message which channels say something, and in which tracks, is chance.
    """
    is_there = decoding.verdict != "absent"
    said: list[str] = [] if item.state == "read" or (item.state == "silent" and not is_there) else [item.state]
    if item.exchanged and item.glimpse is not None and is_there:
        said.append(f"exchanged: is track {item.glimpse.name}")
    return ", ".join(said)


def score_rows(decoding: Decoding) -> list[Row]:
    """One row a channel and position, also of channels that could not be read."""
    rows = []
    scheme = decoding.scheme
    for item in decoding.channels:
        count, note = item.channel.symbols, channel_note(item, decoding)
        first = 0 if scheme.combine == "same" else scheme.first_position(item.channel)
        for position in range(count):
            name = item.channel.name if count == 1 else f"{item.channel.name}.{position}"
            scores: Floats = np.full(scheme.alphabet_size, np.nan)
            if item.reading is not None:
                scores = item.reading.scores[position]
            symbol, is_sure = _read_at(decoding, first + position)
            rows.append(Row(name, note, scores, None if item.reading is None else symbol, is_sure))
    return rows


def _read_at(decoding: Decoding, place: int) -> tuple[int | None, bool | None]:
    """The symbol at a place and whether it is certain; a frame's symbols are in another order."""
    if decoding.scheme.framing is not None:
        return None, None
    is_sure = place not in decoding.uncertain
    return (decoding.symbols[place] if is_sure else None), is_sure


def evidence_rows(decoding: Decoding) -> tuple[list[str], list[str], Floats]:
    """Names, notes and bits of evidence: of symbols, or of channels where a frame has a check of its own.

    Without a message the evidence for any message is all there is. Bits are NaN in rows that are there for their note.
    """
    channels = decoding.channels
    if decoding.verdict == "absent":
        values = [("any message", "", decoding.evidence.nats)]
        values += [
            (item.channel.name, channel_note(item, decoding), None) for item in channels if channel_note(item, decoding)
        ]
    elif decoding.scheme.framing is not None:
        values = [(item.channel.name, channel_note(item, decoding), item.nats) for item in channels]
    elif decoding.scheme.combine == "same":
        values = [(f"symbol {place}", "", nats) for place, nats in enumerate(decoding.symbol_nats)]
        values += [
            (item.channel.name, channel_note(item, decoding), None) for item in channels if channel_note(item, decoding)
        ]
    else:
        rows = score_rows(decoding)
        values = [(row.name, row.note, nats) for row, nats in zip(rows, decoding.symbol_nats, strict=True)]
    names, notes, nats = (list(column) for column in zip(*values, strict=True))
    return names, notes, np.array([math.nan if value is None else value / math.log(2.0) for value in nats])
