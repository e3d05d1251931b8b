"""Trackers by name."""

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from mtm_audit.model.picture import Frame, Pixels
from mtm_audit.model.track import Track
from mtm_audit.tracking.gather import Progress
from mtm_onboard.protocol.errors import MtmError

TRACKERS = ", ".join(
    [
        "aruco[:<dictionary, such as 6x6_250>][,mirrored]",
        "colour:<name, #rrggbb or hsv(H-H,S-S,V-V)>[,<another>...]",
        "centroid:<colour>[,<reach>]",
        "brightness[:<x0>,<y0>,<x1>,<y1>[,<threshold>]]",
        "arms[:<inner colour>,<outer colour>]",
        "football[:<colour>,...]",
        "flow:<x0>,<y0>,<x1>,<y1>",
    ]
)


class Tracker(Protocol):
    """Turns frames of the `pixels` that it wants into tracks."""

    pixels: Pixels

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """One track per thing seen; raises MtmError when nothing is seen or the size of the picture changes."""
        ...


def tracker(name: str, warn: Callable[[str], None] | None = None) -> Tracker:
    """The tracker of that name, such as `aruco` or `colour:red,#00ffff` (`TRACKERS`).

    `warn` receives one sentence for each thing that it cannot tell. Raises MtmError for other names.
    """
    kind, _, choice = name.partition(":")
    if kind == "aruco":
        from mtm_audit.tracking.aruco import parse_aruco

        return parse_aruco(choice, warn)
    if kind == "colour" and choice:
        from mtm_audit.tracking.colour import ColourTracker
        from mtm_audit.tracking.cover import split_colours

        return ColourTracker(split_colours(choice))
    if kind == "centroid" and choice:
        from mtm_audit.tracking.centroid import parse_centroid

        return parse_centroid(choice)
    if kind == "brightness":
        from mtm_audit.tracking.brightness import parse_brightness

        return parse_brightness(choice)
    if kind == "arms":
        from mtm_audit.tracking.arms import parse_arms

        return parse_arms(choice)
    if kind == "football":
        from mtm_audit.tracking.football import parse_football

        return parse_football(choice)
    if kind == "flow":
        from mtm_audit.tracking.flow import parse_flow

        return parse_flow(choice)
    raise MtmError(f"there is no tracker {name!r}; choose one of: {TRACKERS}")


def is_flipped(tracker: Tracker) -> bool:
    """Whether the tracks that it made are those of the mirrored pictures."""
    return bool(getattr(tracker, "flipped", False))


def in_picture(tracker: Tracker, tracks: Sequence[Track]) -> Sequence[Track]:
    """The tracks that it made where the pictures show them, if it took jumps out of them."""
    with_jumps: Sequence[Track] = getattr(tracker, "with_jumps", tracks)
    return with_jumps
