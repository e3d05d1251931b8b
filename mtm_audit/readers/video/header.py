"""What a video file says of itself."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_audit.readers.video.opened import opened_video

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

_EARLIEST_UNIX_S = 1e9


@dataclass(frozen=True)
class VideoFile:
    """What the file says of itself; what it does not say is None. `created_unix_s` is when it was recorded.

    `frame_count` is the number that is announced, also for what no player shows: good for a progress bar, no more.
    """

    path: Path
    width_px: int
    height_px: int
    duration_s: float | None
    frame_count: int | None
    created_unix_s: float | None


def inspect_video(path: Path) -> VideoFile:
    """Read size, duration and frame count from the file's header; raises MtmError as `read_frames` does."""
    with opened_video(path) as (container, stream):
        return VideoFile(
            path,
            stream.width,
            stream.height,
            announced_duration_s(stream),
            max(0, stream.frames) or None,
            _created(container),
        )


def announced_duration_s(stream: "VideoStream") -> float | None:
    """How long the stream says that it lasts; Matroska says so in a tag."""
    if stream.duration is not None and stream.time_base is not None:
        return float(stream.duration * stream.time_base)
    said = next((text for name, text in stream.metadata.items() if name.upper().startswith("DURATION")), "")
    try:
        hours, minutes, seconds = said.split(":")
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
    except ValueError:
        return None


def _created(container: "InputContainer") -> float | None:
    """Seconds since the Unix epoch of the metadata's creation time; None when it is missing or no time at all."""
    try:
        created = datetime.fromisoformat(container.metadata["creation_time"])
    except (KeyError, ValueError):
        return None
    # Without a zone the container formats mean UTC. Cameras whose clock was never set say 1904 or 1970.
    unix_s = (created if created.tzinfo else created.replace(tzinfo=UTC)).timestamp()
    return unix_s if unix_s > _EARLIEST_UNIX_S else None
