"""What a source tells the watch, one thing after the other."""

from dataclasses import dataclass

from mtm_audit.model.picture import Frame


@dataclass(frozen=True)
class Pose:
    """Where a body was at `time_s` of the watch, metres or whatever the sender counts in; NaN out of sight.

    `heading_rad` is counter-clockwise from +x, NaN where nobody says.
    """

    name: str
    time_s: float
    x: float
    y: float
    heading_rad: float = float("nan")


@dataclass(frozen=True)
class Notice:
    """One sentence that a person should know."""

    sentence: str


@dataclass(frozen=True)
class Quiet:
    """Nothing came for a moment."""


# A source may also raise MtmError, when it cannot go on.
Event = Frame | Pose | Notice | Quiet
