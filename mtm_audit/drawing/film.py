"""Writing films and single pictures that appear whole or not at all."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from mtm_audit.model.picture import Frame, Image
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.output_file import mark_of, marked_png, output_file

_TIME_BASE = Fraction(1, 90_000)
# The movie's own clock, in whole milliseconds by default, would round the time of the first picture.
_MUXER = {"movflags": "faststart", "movie_timescale": str(_TIME_BASE.denominator)}
# Lines of one pixel survive this, and a player finds any place within two seconds.
_ENCODER = {"crf": "20", "preset": "veryfast", "g": "60"}
_NOMINAL_HZ = 30


@contextmanager
def film_writer(path: Path, command: str, *, force: bool = False) -> Iterator[Callable[[Frame], None]]:
    """Yield what takes one frame (blue, green and red) after the other and encodes it as H.264 into an MP4 at `path`.

    Each frame keeps its own time; none is held longer than the encoder holds it. A side of an odd number of pixels is
    made one longer, as yuv420p wants. The film carries the mark of `command`. Raises MtmError when no frame came, times
    do not increase, or something stands there that the command did not make, unless with `force`.
    """
    import av

    with (
        output_file(path, command, force=force) as temporary,
        av.open(str(temporary), "w", format="mp4", options=_MUXER) as container,
    ):
        container.metadata["comment"] = mark_of(command)
        stream = container.add_stream("libx264", rate=_NOMINAL_HZ, options=_ENCODER)
        stream.time_base = stream.codec_context.time_base = _TIME_BASE
        stream.pix_fmt = "yuv420p"
        last = None

        def write(frame: Frame) -> None:
            nonlocal last
            image = _even(frame.image)
            if last is None:
                stream.width, stream.height = image.shape[1], image.shape[0]
            picture = av.VideoFrame.from_ndarray(image, format="bgr24").reformat(format="yuv420p")
            picture.pts, picture.time_base = round(frame.time_s / _TIME_BASE), _TIME_BASE
            if last is not None and picture.pts <= last:
                raise MtmError(f"frame time {frame.time_s:.6f} s does not come after the one before; sort the frames")
            last = picture.pts
            container.mux(stream.encode(picture))

        yield write
        if last is None:
            raise MtmError(f"there is no frame to write to {path}; choose a recording with pictures")
        container.mux(stream.encode(None))


def write_picture(image: Image, path: Path, command: str, *, force: bool = False) -> None:
    """Write one picture as PNG with the mark of `command`; raises MtmError as `output_file` does."""
    with output_file(path, command, force=force) as temporary:
        done, content = cv2.imencode(".png", image)
        assert done
        temporary.write_bytes(marked_png(content.tobytes(), command))


def _even(image: Image) -> Image:
    """The picture with its last column and row repeated where their number is odd."""
    height, width = image.shape[:2]
    if not (height % 2 or width % 2):
        return image
    return np.asarray(cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE), dtype=np.uint8)
