"""Between the robot's clock and the recording's: which instant is which tick."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Tick k of the message was played at `onset_s + k / rate_hz` of the recording's clock."""

    onset_s: float
    rate_hz: float


@dataclass(frozen=True)
class OnsetRange:
    """The first window began within these instants of the recording's clock, which may lie before its start."""

    low_s: float
    high_s: float


# When the first window began: known, known within bounds, or anywhere in the recording.
Onset = float | OnsetRange | None
