"""Opening a video file and choosing the stream of pictures that moves."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_audit.readers.text import check_readable
from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

_STILL_CODECS = frozenset({"bmp", "gif", "jpeg2000", "mjpeg", "png", "tiff", "webp"})


@contextmanager
def opened_video(path: Path) -> Iterator[tuple["InputContainer", "VideoStream"]]:
    """Yield container and stream, set up to decode with as many threads as suit the machine.

    Raises MtmError when the file is missing, empty, a folder, or holds no film, and for whatever of `decoding_errors`
    is raised while it is open and not caught there.
    """
    import av

    check_readable(path)
    try:
        container = av.open(str(path))
    except decoding_errors() as error:
        raise MtmError(
            f"{path} is not a video that can be read, or its end is missing; copy it again or convert it to MP4"
        ) from error
    try:
        with container:
            stream = film_of(path, container)
            # Damage is to stop the decoder: pictures that it patches up look plausible and are wrong.
            stream.codec_context.options = {"err_detect": "explode"}
            stream.thread_type = "AUTO"
            yield container, stream
    except decoding_errors() as error:
        raise MtmError(
            f"{path} is a video that cannot be read ({_reason(error)}); copy it again or convert it to MP4"
        ) from error


def decoding_errors() -> tuple[type[Exception], ...]:
    """What the libraries raise for files that are damaged or not what they seem: of their own, and of the language's.

    Sizes and rates that such a file states ask for more memory than there is, or for a division by zero.
    """
    import av

    # What was not imported raises nothing, and importing it takes long.
    opencv = [sys.modules["cv2"].error] if "cv2" in sys.modules else []
    return av.FFmpegError, OSError, EOFError, ValueError, ArithmeticError, MemoryError, RuntimeError, *opencv


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__


def film_of(path: Path | str, container: "InputContainer") -> "VideoStream":
    """The first stream that is no still picture: drones and cutters put a cover into the file, often first.

    Raises MtmError, which names `path`, when there is none.
    """
    streams = container.streams.video
    if not streams:
        raise MtmError(f"{path} holds no video stream; name a file with pictures in it")
    films = [stream for stream in streams if not _is_cover(stream)]
    if not films:
        raise MtmError(f"{path} holds a cover picture and no film; name a file with a film in it")
    films = [stream for stream in films if stream.codec_context is not None]
    if not films:
        raise MtmError(f"{path} is coded in a way that cannot be read here; convert it to H.264 in MP4")
    # Not every program marks its cover as one.
    return next((stream for stream in films if stream.codec_context.name not in _STILL_CODECS), films[0])


def _is_cover(stream: "VideoStream") -> bool:
    from av.stream import Disposition

    return bool(stream.disposition & (Disposition.attached_pic | Disposition.timed_thumbnails))
