"""Video files: frames one after the other, each with the time that the file states for it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mtm_audit.model.picture import Frame, Image, Pixels
from mtm_audit.readers.text import check_readable
from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.video.stream import VideoStream

# Formats whose first plane is the gray picture itself, so that gray costs no conversion.
PLANAR_LUMA = frozenset({"gray", "yuv420p", "yuvj420p", "yuv422p", "yuvj422p", "yuv444p", "yuvj444p", "nv12"})


_EARLIEST_UNIX_S = 1e9


@dataclass(frozen=True)
class VideoFile:
    """What the file says of itself; what it does not say is None. `created_unix_s` is when it was recorded."""

    path: Path
    width_px: int
    height_px: int
    duration_s: float | None
    frame_count: int | None
    created_unix_s: float | None


def inspect_video(path: Path) -> VideoFile:
    """Read size, duration and frame count from the file's header; raises MtmError as `read_frames` does."""
    with _opened(path) as (container, stream):
        duration_s = None
        if stream.duration is not None and stream.time_base is not None:
            duration_s = float(stream.duration * stream.time_base)
        return VideoFile(path, stream.width, stream.height, duration_s, stream.frames or None, _created(container))


def read_frames(path: Path, pixels: Pixels = "gray", warn: Callable[[str], None] | None = None) -> Iterator[Frame]:
    """Decode the first video stream lazily, in order of presentation, with the time stamps of the file.

    A file that breaks off or turns corrupt yields the frames before the break, then calls `warn` with one sentence.
    Frames without a time stamp that comes after the one before are left out and counted in a warning.
    Raises MtmError when the file is missing, empty, a folder, no video, or not one frame of it can be decoded.
    """
    say = warn or (lambda sentence: None)
    decoded = untimed = 0
    last_s = -np.inf
    damage: str | None = None
    with _opened(path) as (container, stream):
        expected = stream.frames
        pictures = _decode(container, stream)
        while True:
            try:
                picture = next(pictures)
            except StopIteration:
                break
            except (OSError, ValueError) as error:
                damage = str(error)
                break
            decoded += 1
            if picture.time is None or picture.time <= last_s:
                untimed += 1
                continue
            last_s = picture.time
            yield Frame(picture.time, _image(picture, pixels))
    if not decoded:
        raise MtmError(f"{path} holds no picture that can be decoded; copy it again or record it anew")
    if damage is None and decoded < expected:
        damage = f"{expected - decoded} of {expected} frames are missing"
    if damage is not None:
        say(f"{path} is damaged after {last_s:.3f} s ({damage}); only the {decoded} frames before that are used")
    if untimed:
        say(f"{untimed} frames of {path} have no time stamp that comes after the one before; they are left out")


def _created(container: "InputContainer") -> float | None:
    """Seconds since the Unix epoch of the metadata's creation time; None when it is missing or no time at all."""
    try:
        created = datetime.fromisoformat(container.metadata["creation_time"])
    except (KeyError, ValueError):
        return None
    # Without a zone the container formats mean UTC. Cameras whose clock was never set say 1904 or 1970.
    unix_s = (created if created.tzinfo else created.replace(tzinfo=UTC)).timestamp()
    return unix_s if unix_s > _EARLIEST_UNIX_S else None


@contextmanager
def _opened(path: Path) -> Iterator[tuple["InputContainer", "VideoStream"]]:
    import av

    check_readable(path)
    try:
        container = av.open(str(path))
    except (OSError, ValueError) as error:
        raise MtmError(
            f"{path} is not a video that can be read, or its end is missing; copy it again or convert it to MP4"
        ) from error
    with container:
        if not container.streams.video:
            raise MtmError(f"{path} holds no video stream; name a file with pictures in it")
        stream = container.streams.video[0]
        # Damage is to stop the decoder: pictures that it patches up look plausible and are wrong.
        stream.codec_context.options = {"err_detect": "explode"}
        yield container, stream


def _decode(container: "InputContainer", stream: "VideoStream") -> Iterator["VideoFrame"]:
    for picture in container.decode(stream):
        if picture.is_corrupt:
            raise ValueError("a frame is corrupt")
        yield picture


def _image(picture: "VideoFrame", pixels: Pixels) -> Image:
    if pixels == "gray" and picture.format.name in PLANAR_LUMA:
        plane = picture.planes[0]
        rows = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        return np.ascontiguousarray(rows[: picture.height, : picture.width])
    if pixels == "bgr" and picture.format.name == "yuv420p" and picture.width % 2 == picture.height % 2 == 0:
        import cv2

        # OpenCV converts the most common format eight times faster than the decoder's own library.
        return np.asarray(cv2.cvtColor(picture.to_ndarray(), cv2.COLOR_YUV2BGR_I420), dtype=np.uint8)
    return np.asarray(picture.to_ndarray(format="gray" if pixels == "gray" else "bgr24"), dtype=np.uint8)
