"""Following things in frames that come one by one, for as long as they come."""

from dataclasses import dataclass
from typing import Protocol

from mtm_audit.model.picture import Frame, Pixels
from mtm_audit.model.track import Track
from mtm_audit.tracking.gather import check_size
from mtm_onboard.protocol.errors import MtmError

FOLLOWING = "aruco, colour or centroid"


class Following(Protocol):
    """What a tracker knows between two frames of the `pixels` that it wants.

    `flipped` when the tracks are those of the mirrored pictures.
    """

    @property
    def pixels(self) -> Pixels:
        """What it wants to look at."""
        ...

    @property
    def flipped(self) -> bool:
        """Whether tracks are those of the mirrored pictures."""
        ...

    def look(self, frame: Frame) -> None:
        """Look at the next frame."""
        ...

    def tracks(self) -> list[Track]:
        """What was seen so far, as the tracker would give it for a film that ends here; none when nothing was."""
        ...

    def latest(self) -> dict[str, tuple[float, float]]:
        """Column and row (y down) in the last frame of what was seen there."""
        ...

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        ...


def following(name: str) -> Following:
    """What follows as the tracker of that name does; raises MtmError where that tracker takes whole films alone."""
    from mtm_audit.tracking.aruco import ArucoTracker
    from mtm_audit.tracking.centroid import CentroidTracker
    from mtm_audit.tracking.colour import ColourTracker
    from mtm_audit.tracking.registry import tracker

    chosen = tracker(name)
    if isinstance(chosen, ArucoTracker | ColourTracker | CentroidTracker):
        return OneSize(chosen.following())
    raise MtmError(
        f"the tracker {name.partition(':')[0]} takes whole films alone; watch with {FOLLOWING}, or record the film and "
        "decode it"
    )


@dataclass
class OneSize:
    """Refuses, with MtmError, a frame of another size than those before it."""

    inner: Following
    size: tuple[int, int] | None = None

    @property
    def pixels(self) -> Pixels:
        """As the inner one has it."""
        return self.inner.pixels

    @property
    def flipped(self) -> bool:
        """As the inner one has it."""
        return self.inner.flipped

    def look(self, frame: Frame) -> None:
        """Look at a frame of the same size."""
        check_size(frame, self.size)
        self.size = frame.size
        self.inner.look(frame)

    def tracks(self) -> list[Track]:
        """As the inner one has them."""
        return self.inner.tracks()

    def latest(self) -> dict[str, tuple[float, float]]:
        """As the inner one has it."""
        return self.inner.latest()

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self.inner.forget(before_s)
