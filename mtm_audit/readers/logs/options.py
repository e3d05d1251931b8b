"""What a person says about a log beyond what is in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from mtm_onboard.protocol.errors import MtmError

METRES = MappingProxyType({"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048})
SECONDS = MappingProxyType({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
AXES = ("x", "y", "z", "-x", "-y", "-z")


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """How to read a log where it leaves something open.

    `unit` and `time_unit` are those of its positions and times, `up` the axis that points away from the floor; each
    comes before what the file says or its format usually has. `heading_axis` is the axis of a body whose direction is
    its heading, None for the one that lies level. `topics` are the parts to read of a log that holds several, and
    `bodies` the markers of rigid bodies by the body's name. `arrival_times` takes the instants at which messages were
    recorded instead of those that they carry. Raises MtmError when a unit or an axis is unknown.
    """

    unit: str | None = None
    time_unit: str | None = None
    up: str | None = None
    heading_axis: str | None = None
    topics: tuple[str, ...] = ()
    bodies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    arrival_times: bool = False

    def __post_init__(self) -> None:
        _check("unit of length", self.unit, tuple(METRES))
        _check("unit of time", self.time_unit, tuple(SECONDS))
        _check("axis", self.up, AXES)
        _check("axis of a body", self.heading_axis, AXES)

    def metres(self, stated: str | None = None) -> float:
        """Metres in the unit of the positions, of which the file states `stated`."""
        return METRES[self.unit or stated or "m"]

    def seconds(self, stated: str | None = None) -> float:
        """Seconds in the unit of the times, of which the file states `stated`."""
        return SECONDS[self.time_unit or stated or "s"]


def marker_groups(texts: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """The markers of bodies as `--body NAME=MARKER,MARKER` names them; raises MtmError for what is not so."""
    groups: dict[str, tuple[str, ...]] = {}
    for text in texts:
        body, _, markers = text.partition("=")
        names = tuple(marker.strip() for marker in markers.split(",") if marker.strip())
        if not body or not names:
            raise MtmError(f"{text!r} is not NAME=MARKER,MARKER, such as robot0=front,left,right; write --body so")
        if body in groups:
            raise MtmError(f"--body names {body!r} twice; give all its markers at once")
        groups[body] = names
    return groups


def _check(what: str, name: str | None, known: tuple[str, ...]) -> None:
    if name is not None and name not in known:
        raise MtmError(f"{name!r} is no {what}; give one of {', '.join(known)}")
