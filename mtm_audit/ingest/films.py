"""The pictures of one film, in however many files it came."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from mtm_audit.model.compression import Compression
from mtm_audit.model.picture import Frame, Pixels
from mtm_audit.readers.picture_folder import PICTURE_SUFFIXES, pictures_in, read_pictures
from mtm_audit.readers.video import inspect_video, read_frames
from mtm_audit.readers.video.compression import read_compression

Warn = Callable[[str], None]


def film_frames(files: Sequence[Path], pixels: Pixels, warn: Warn, frame_rate_hz: float | None) -> Iterator[Frame]:
    """All frames of a film: of a video, of the chapters that a camera cut it into, or of a folder of pictures.

    A chapter begins where the one before it ends. `frame_rate_hz` replaces the times of the files. Raises MtmError as
    `read_frames` and `read_pictures` do.
    """
    pictures = _pictures(files)
    if pictures:
        yield from read_pictures(pictures, pixels, warn, frame_rate_hz)
        return
    begins_s = 0.0
    for file in files:
        last_s = step_s = 0.0
        for frame in read_frames(file, pixels, warn, frame_rate_hz):
            last_s, step_s = frame.time_s, frame.time_s - last_s
            yield frame if begins_s == 0.0 else Frame(begins_s + frame.time_s, frame.image)
        announced_s = inspect_video(file).duration_s if len(files) > 1 and frame_rate_hz is None else None
        begins_s += last_s + step_s if announced_s is None else announced_s


def film_length(files: Sequence[Path]) -> int | None:
    """How many frames are announced; None when the files do not say."""
    pictures = _pictures(files)
    if pictures:
        return len(pictures)
    counts = [inspect_video(file).frame_count for file in files]
    return None if None in counts else sum(count for count in counts if count is not None)


def film_compression(files: Sequence[Path]) -> Compression | None:
    """How coarsely a film is coded, by its first file; None for pictures, which say nothing of it."""
    return None if _pictures(files) else read_compression(files[0])


def is_picture(path: Path) -> bool:
    """By its suffix."""
    return path.suffix.lower() in PICTURE_SUFFIXES


def _pictures(files: Sequence[Path]) -> list[Path]:
    """The pictures that a film consists of; none when it is a video."""
    if len(files) == 1 and files[0].is_dir():
        return pictures_in(files[0])
    return list(files) if all(map(is_picture, files)) else []
