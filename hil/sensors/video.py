"""Writing video whose time stamps are the camera's own."""

from collections.abc import Iterable
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from hil.sensors.encoding import Encoding, constant_quality
from mtm_audit.model.picture import Frame, Image
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError

TIME_BASE = Fraction(1, 90_000)
# The index in front lets a copy that breaks off be read up to the break; the movie's own clock, in whole
# milliseconds by default, would round the time of the first frame.
MUXER = {"movflags": "faststart", "movie_timescale": str(TIME_BASE.denominator)}
# ITU-R BT.601, limited range.
BGR_TO_UV = np.array([[0.439, -0.291, -0.148, 128], [-0.071, -0.368, 0.439, 128]])


def write_video(
    frames: Iterable[Frame],
    path: Path,
    nominal_rate_hz: float = 30.0,
    crf: int = 18,
    began_unix_s: float | None = None,
) -> int:
    """Encode `frames` as `encode_video` does, as H.264 at constant quality `crf`."""
    return encode_video(frames, path, nominal_rate_hz, constant_quality(crf), began_unix_s)


def encode_video(
    frames: Iterable[Frame], path: Path, nominal_rate_hz: float, encoding: Encoding, began_unix_s: float | None = None
) -> int:
    """Encode `frames` (blue, green, red) into MP4; returns their number.

    Each frame keeps its own time, to 1/90000 s, so irregular and dropped frames survive; `nominal_rate_hz` only
    guides the encoder. The file says when it began, to a second, where that is known. Raises MtmError when there is no
    frame, a size is odd, or times do not increase.
    """
    count = 0
    with replacing(path) as temporary, av.open(str(temporary), "w", format="mp4", options=MUXER) as container:
        if began_unix_s is not None:
            container.metadata["creation_time"] = datetime.fromtimestamp(began_unix_s, UTC).isoformat()
        stream = container.add_stream(encoding.codec, rate=Fraction(nominal_rate_hz).limit_denominator(1001))
        assert isinstance(stream, av.VideoStream)
        stream.time_base = stream.codec_context.time_base = TIME_BASE
        last_pts = -1
        for frame in frames:
            if count == 0:
                encoding.set_up(stream, _even(frame.size), nominal_rate_hz)
            picture = av.VideoFrame.from_ndarray(_planes(frame.image), format="yuv420p")
            if encoding.pixel_format != "yuv420p":
                picture = picture.reformat(format=encoding.pixel_format)
            picture.pts, picture.time_base = round(frame.time_s / TIME_BASE), TIME_BASE
            if picture.pts <= last_pts:
                raise MtmError(f"frame time {frame.time_s:.6f} s does not come after the one before; sort the frames")
            last_pts = picture.pts
            container.mux(stream.encode(picture))
            count += 1
        if not count:
            raise MtmError(f"there is no frame to write to {path}; record a longer span")
        container.mux(stream.encode(None))
    return count


def _planes(image: Image) -> Image:
    """Y, U and V planes of a picture, one below the other, shape (3 / 2 height, width).

    OpenCV takes the colour of each 2 x 2 block from its first pixel, which moves coloured edges; here it is the mean.
    """
    height, width, _ = image.shape
    planes = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
    blocks = cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    planes[height:] = np.moveaxis(cv2.transform(blocks, BGR_TO_UV), 2, 0).reshape(-1, width)
    return planes


def _even(size: tuple[int, int]) -> tuple[int, int]:
    if size[0] % 2 or size[1] % 2:
        raise MtmError(f"a picture of {size[0]} x {size[1]} cannot be H.264 in yuv420p; choose even numbers of pixels")
    return size
