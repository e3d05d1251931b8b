"""How a video file is made: container, codec, how it is turned, whose times it has, and what it hides."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mtm_audit.readers.video.clock import EvenClock, OrderClock, clock_of
from mtm_audit.readers.video.opened import decoding_errors, opened_video
from mtm_audit.readers.video.orientation import Orientation, orientation_of

# Stated with each picture; by the order of the file; even, at a rate that is stated or given.
Times = Literal["stated", "order", "even"]


@dataclass(frozen=True, kw_only=True)
class FilmStructure:
    """`width_px` and `height_px` are those of the stored picture, before it is turned by `turned_deg` clockwise.

    `turned_deg` is 0, 90, 180 or 270, None for an odd angle that is not heeded; `mirrored` says that it is mirrored
    left and right after that. `hidden` is how many pictures the edit list hides from players.
    """

    container: str
    codec: str
    width_px: int
    height_px: int
    turned_deg: int | None
    mirrored: bool
    times: Times
    hidden: int


def read_structure(path: Path, frame_rate_hz: float | None = None) -> FilmStructure:
    """What the file's packets and first picture say; raises MtmError as `read_frames` does."""
    with opened_video(path) as (container, stream):
        clock = clock_of(path, container, stream, frame_rate_hz, lambda sentence: None)
        times: Times = (
            "even" if isinstance(clock, EvenClock) else "order" if isinstance(clock, OrderClock) else "stated"
        )
        orientation: Orientation | None = Orientation()
        hidden, seen = 0, False
        try:
            for packet in container.demux(stream):
                hidden += packet.is_discard and packet.size > 0
                if not seen:
                    for picture in packet.decode():
                        orientation, seen = orientation_of(picture), True
        except decoding_errors():
            # Reading the frames says what is damaged.
            pass
        turned_deg, mirrored = (None, False) if orientation is None else _turn(orientation)
        return FilmStructure(
            container=_container(container.format.name, path),
            codec=stream.codec_context.name,
            width_px=stream.width,
            height_px=stream.height,
            turned_deg=turned_deg,
            mirrored=mirrored,
            times=times,
            hidden=hidden,
        )


def _container(names: str, path: Path) -> str:
    """The format by the file's suffix, where the library knows several by one reader."""
    known, suffix = names.split(","), path.suffix.lower().removeprefix(".")
    return suffix if suffix in known else known[0]


def _turn(orientation: Orientation) -> tuple[int, bool]:
    """Degrees clockwise, and whether left and right are exchanged afterwards."""
    across, down = orientation.left_right, orientation.upper_lower
    # Rows that become columns are a quarter turn clockwise seen in a mirror.
    return (270 if down else 90, across == down) if orientation.transposed else (180 if down else 0, across != down)
