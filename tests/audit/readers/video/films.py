"""Films that tests make with real encoders and muxers."""

import struct
from dataclasses import dataclass, field
from fractions import Fraction

import av
import numpy as np

WIDTH, HEIGHT = 128, 96
RATE_HZ = 30
BLOCKS = np.kron(np.random.default_rng(1).integers(0, 255, (6, 8, 3)), np.ones((16, 16, 1))).astype(np.uint8)


@dataclass(frozen=True, kw_only=True)
class Encoding:
    """How a film is written; `format` None goes by the suffix."""

    codec: str = "libx264"
    pixel_format: str = "yuv420p"
    options: dict[str, str] = field(default_factory=dict)
    format: str | None = None
    rate_hz: int = RATE_HZ


KINDS = {
    "film.mp4": Encoding(),
    "film.mkv": Encoding(),
    "film.ts": Encoding(),
    "film.avi": Encoding(),
    "film.h264": Encoding(format="h264"),
    "hevc.mp4": Encoding(codec="libx265", options={"x265-params": "log-level=none"}),
    "mjpeg.avi": Encoding(codec="mjpeg", pixel_format="yuvj420p"),
}


def pictures(count):
    """Blocks of colour that move by three pixels each time."""
    return [np.roll(BLOCKS, 3 * number, axis=1) for number in range(count)]


def write_film(path, images, encoding=Encoding(), *, skipped=(), stamps=None, prepare=None):
    """Write blue-green-red images; those whose numbers are `skipped` keep their times free.

    `stamps` are times in units of one picture unless the encoding's rate says otherwise; `prepare(container, stream)`
    may set up more.
    """
    with av.open(str(path), "w", format=encoding.format) as container:
        stream = container.add_stream(encoding.codec, rate=encoding.rate_hz, options=encoding.options)
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = encoding.pixel_format
        if prepare is not None:
            prepare(container, stream)
        for number, image in enumerate(images):
            if number in skipped:
                continue
            picture = av.VideoFrame.from_ndarray(image, format="bgr24")
            picture.pts = number if stamps is None else stamps[number]
            picture.time_base = Fraction(1, encoding.rate_hz)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def remux(source, target, *, from_s=0.0, until_s=np.inf, shift_s=0.0):
    """Copy packets without encoding anew, from the key frame before `from_s` on; `from_s` becomes time zero."""
    with av.open(str(source)) as before, av.open(str(target), "w") as after:
        stream = before.streams.video[0]
        copy = after.add_stream_from_template(stream)
        before.seek(round(from_s / stream.time_base), stream=stream)
        offset = round((from_s - shift_s) / stream.time_base)
        for packet in before.demux(stream):
            if packet.dts is None or packet.pts * stream.time_base >= until_s:
                continue
            packet.pts, packet.dts = packet.pts - offset, packet.dts - offset
            packet.stream = copy
            after.mux(packet)
    return target


def turn(path, degrees, *, left_right=False, upper_lower=False):
    """Have players turn an MP4 counter-clockwise and then mirror it, by the matrix in its track header."""
    angle = np.deg2rad(degrees)
    a, b, c, d = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    across, down = (-1.0 if left_right else 1.0), (-1.0 if upper_lower else 1.0)
    matrix = [a * across, b * down, 0.0, c * across, d * down, 0.0, 0.0, 0.0, float(1 << 14)]
    content = bytearray(path.read_bytes())
    place = content.index(b"tkhd") + 44
    content[place : place + 36] = struct.pack(">9i", *(round(value * (1 << 16)) for value in matrix))
    path.write_bytes(content)
    return path
