"""A film as single pictures: JPEG, PNG and TIFF files, whose names say their order and at times their instants."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from mtm_audit.model.picture import Frame, Image, Pixels
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.errors import MtmError

PICTURE_SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff"})
# Seconds since the Unix epoch, from 2001 to 2286, as robots name their pictures: 1403636579763555584.png.
_STAMP = re.compile(r"1\d{9}\.\d+|1\d{18}|1\d{15}|1\d{12}|[2-9]\d{9}\.\d+")
_PER_SECOND = {19: 1e9, 16: 1e6, 13: 1e3}


def pictures_in(folder: Path) -> list[Path]:
    """The pictures of a folder in the order of the numbers in their names; empty when it holds fewer than two.

    Raises MtmError when the folder may not be read.
    """
    try:
        found = [path for path in folder.iterdir() if path.suffix.lower() in PICTURE_SUFFIXES]
    except OSError as error:
        raise MtmError(f"{folder} cannot be read ({error.strerror}); check its permissions") from error
    return sorted(found, key=_order) if len(found) > 1 else []


def read_pictures(
    paths: Sequence[Path],
    pixels: Pixels = "gray",
    warn: Callable[[str], None] | None = None,
    frame_rate_hz: float | None = None,
) -> Iterator[Frame]:
    """The pictures as frames. `paths` are in the order of time.

    Names that are times since the Unix epoch give the times unless a rate does. With a rate, a number that is missing
    in an otherwise steady count is a picture that was lost, and its time stays empty. Raises MtmError when neither says
    when the pictures were taken, or one cannot be read.
    """
    times_s = _times_s(paths, frame_rate_hz, warn or (lambda sentence: None))
    for path, time_s in zip(paths, times_s, strict=True):
        yield Frame(float(time_s), _image(path, pixels))


def _times_s(paths: Sequence[Path], frame_rate_hz: float | None, warn: Callable[[str], None]) -> Floats:
    stems = [path.stem for path in paths]
    if frame_rate_hz is not None:
        if not (math.isfinite(frame_rate_hz) and frame_rate_hz > 0.0):
            raise MtmError(f"{frame_rate_hz} pictures a second cannot be; give a number above zero")
        return _counts(stems) / frame_rate_hz
    if not all(_STAMP.fullmatch(stem) for stem in stems):
        raise MtmError(
            f"the pictures in {paths[0].parent} do not say when they were taken; say with --frame-rate how many a "
            "second there are"
        )
    times_s = np.array([float(stem) if "." in stem else int(stem) / _PER_SECOND[len(stem)] for stem in stems])
    if np.any(np.diff(times_s) <= 0.0):
        raise MtmError(f"two pictures in {paths[0].parent} have the same time in their names; remove one of them")
    warn(f"the times of the pictures in {paths[0].parent} are those in their names, since the Unix epoch")
    return times_s


def _counts(stems: Sequence[str]) -> Floats:
    """0, 1, 2 ... with a gap for each number that is missing, where the names count steadily; else without gaps."""
    count = np.arange(len(stems), dtype=np.float64)
    ends = [re.fullmatch(r"(.*?)(\d{1,15})", stem, re.DOTALL) for stem in stems]
    if any(end is None for end in ends) or len({end[1] for end in ends if end}) > 1:
        return count
    numbers = np.array([int(end[2]) for end in ends if end], dtype=np.int64)
    steps = np.diff(numbers)
    step = int(np.median(steps)) if len(steps) else 1
    # Most steps alike and all of them multiples: the rest are gaps.
    steady = step > 0 and np.mean(steps == step) > 0.5 and np.all(steps % step == 0) and np.all(steps > 0)
    return (numbers - numbers[0]) / step if steady else count


def _order(path: Path) -> list[tuple[int, str]]:
    """So that frame 9 comes before frame 10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.stem) if part]


def _image(path: Path, pixels: Pixels) -> Image:
    import cv2

    try:
        content = np.fromfile(path, np.uint8)
    except OSError as error:
        raise MtmError(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    flags = cv2.IMREAD_GRAYSCALE if pixels == "gray" else cv2.IMREAD_COLOR
    image = None
    # A header that announces more than can be held is an error, and any other damage gives nothing.
    with suppress(cv2.error):
        image = cv2.imdecode(content, flags) if len(content) else None
    if image is None:
        raise MtmError(f"{path} is no picture that can be read; copy it again or remove it")
    return np.asarray(image, dtype=np.uint8)
