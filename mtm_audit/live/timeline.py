"""One time for all that a live source shows, across connections whose own clocks begin anew."""

import math
from dataclasses import dataclass

# Stamps that fall back by so much, or are so far from the clock on the wall, are those of another beginning; playlists
# hand out many seconds at once.
_BACK_S, _LEAP_S = 1.0, 30.0


@dataclass
class Timeline:
    """Counts seconds from the first arrival; within a connection as its stamps do, which arrive more or less late.

    `is_live` False takes the stamps alone, as of a file.
    """

    is_live: bool = True
    _first_arrival_s: float | None = None
    _offset_s: float | None = None
    _last_stamp_s: float = -math.inf
    _last_s: float = -math.inf

    def begin_connection(self) -> None:
        """What comes next has stamps of a new beginning; after a gap it is as late as it arrives."""
        if self.is_live:
            self._offset_s = None
        self._last_stamp_s = -math.inf

    def offset_s(self, stamp_s: float, arrival_s: float) -> float:
        """What is added to the stamps of this connection, from the first one, `stamp_s`, on."""
        if self._first_arrival_s is None:
            self._first_arrival_s = arrival_s
        if self._offset_s is None:
            self._offset_s = self._elapsed(arrival_s) - stamp_s if self.is_live else 0.0
        elif self.is_live and self._begins_anew(self._offset_s, stamp_s, arrival_s):
            self._offset_s = self._elapsed(arrival_s) - stamp_s
        self._last_stamp_s = stamp_s
        return self._offset_s

    def time_s(self, stamp_s: float | None, arrival_s: float) -> float | None:
        """When something was seen; None when that does not come after what was seen before.

        Without a stamp it was seen when it arrived.
        """
        if stamp_s is None:
            stamp_s, self._offset_s = arrival_s, None
        time_s = self.offset_s(stamp_s, arrival_s) + stamp_s
        if time_s <= self._last_s:
            return None
        self._last_s = time_s
        return time_s

    def _begins_anew(self, offset_s: float, stamp_s: float, arrival_s: float) -> bool:
        is_far = abs(offset_s + stamp_s - self._elapsed(arrival_s)) > _LEAP_S
        return is_far or stamp_s < self._last_stamp_s - _BACK_S

    def _elapsed(self, arrival_s: float) -> float:
        return arrival_s - (self._first_arrival_s or 0.0)
