"""Long recordings cut into pieces, which are read one after the other.

Over hours clocks drift by more than can be searched at once, and most of a long recording often holds no message. Each
piece overlaps the next by a message, so that none is cut in two everywhere.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.model.track import Track
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Scheme

# A recording of up to so long is read as a whole; pieces are half as long, or three messages if those are longer.
LONGEST_WHOLE_S = 600.0
_PIECE_S = 300.0
_MESSAGES_A_PIECE = 3.0
# A known onset may be early by this much.
_BEFORE_ONSET_S = 2.0
# A day, and times in milliseconds that were taken for seconds are found out.
_LONGEST_S = 86_400.0


@dataclass(frozen=True)
class Piece:
    """The part of a recording from `begin_s` to `end_s`, one of `count`; `tracks` are those that show something."""

    begin_s: float
    end_s: float
    count: int
    tracks: tuple[Track, ...]


def pieces_of(tracks: Sequence[Track], scheme: Scheme, onset_s: float | None) -> list[Piece]:
    """The pieces of a long recording, the single one from a known onset on; none where it is read as a whole.

    Raises MtmError when it is longer than a day.
    """
    shown = [track for track in tracks if len(track.times_s)]
    if not shown:
        return []
    first_s = min(float(track.times_s[0]) for track in shown)
    last_s = max(float(track.times_s[-1]) for track in shown)
    message_s = scheme.message_ticks / scheme.rate_hz
    length_s = piece_length_s(scheme)
    if last_s - first_s <= max(LONGEST_WHOLE_S, 2.0 * length_s):
        return []
    if not last_s - first_s <= _LONGEST_S:
        raise MtmError(
            f"the recording lasts {last_s - first_s:g} s, and no more than {_LONGEST_S:g} s can be searched; cut out "
            "the part with the message, and check that the times are seconds"
        )
    if onset_s is not None:
        begin_s = onset_s - _BEFORE_ONSET_S
        return [_piece(shown, begin_s, begin_s + length_s, 1)]
    count = math.ceil((last_s - first_s - message_s) / (length_s - message_s))
    begins_s = np.linspace(first_s, last_s - length_s, count)
    return [_piece(shown, float(begin_s), float(begin_s) + length_s, count) for begin_s in begins_s]


def piece_length_s(scheme: Scheme) -> float:
    """How long a piece is: long enough for what one shows of a message, and no longer than clocks run alike."""
    return max(_PIECE_S, _MESSAGES_A_PIECE * scheme.message_ticks / scheme.rate_hz)


def _piece(tracks: Sequence[Track], begin_s: float, end_s: float, count: int) -> Piece:
    cut = (part_of_track(track, begin_s, end_s) for track in tracks)
    return Piece(begin_s, end_s, count, tuple(track for track in cut if track.valid.any()))


def part_of_track(track: Track, begin_s: float, end_s: float) -> Track:
    """The observations from `begin_s` on that come before `end_s`."""
    at = slice(*np.searchsorted(track.times_s, [begin_s, end_s]))
    headings_rad = None if track.headings_rad is None else track.headings_rad[at]
    return replace(
        track,
        times_s=track.times_s[at],
        positions=track.positions[at],
        valid=track.valid[at],
        headings_rad=headings_rad,
        corners=None if track.corners is None else track.corners[at],
    )
