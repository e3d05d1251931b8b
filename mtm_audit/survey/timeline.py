"""When the pictures or samples of a recording were taken."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Floats

# Of the median interval: steadier ones are constant but for rounding, longer ones are gaps.
_STEADY, _GAP = 0.1, 1.5


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """`count` instants from `begin_s` to `end_s`, `rate_hz` of them a second by the median interval.

    `is_constant` when intervals differ by no more than a tenth, gaps left out; `gaps` are intervals longer than one and
    a half of the median, in which `missing` instants would have their place, and `longest_s` is the longest interval.
    """

    count: int
    begin_s: float
    end_s: float
    rate_hz: float | None
    is_constant: bool
    gaps: int
    missing: int
    longest_s: float

    @property
    def duration_s(self) -> float:
        """From the first instant to the last."""
        return self.end_s - self.begin_s


def timeline_of(times_s: Floats) -> Timeline:
    """The timeline of increasing instants, of which there must be one."""
    intervals_s = np.diff(times_s)
    usual_s = float(np.median(intervals_s)) if len(intervals_s) else 0.0
    is_gap = intervals_s > _GAP * usual_s
    between_s = intervals_s[~is_gap]
    return Timeline(
        count=len(times_s),
        begin_s=float(times_s[0]),
        end_s=float(times_s[-1]),
        rate_hz=1.0 / usual_s if usual_s > 0.0 else None,
        is_constant=bool(np.all(np.abs(between_s - usual_s) <= _STEADY * usual_s)),
        gaps=int(is_gap.sum()),
        missing=int(np.sum(np.rint(intervals_s[is_gap] / usual_s) - 1)) if usual_s > 0.0 else 0,
        longest_s=float(intervals_s.max(initial=0.0)),
    )
