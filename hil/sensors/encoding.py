"""How a camera or a program encodes its film."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import av


@dataclass(frozen=True, kw_only=True)
class Encoding:
    """One encoder and what it is told.

    `bits_per_pixel` is the mean bit rate for each pixel of each picture, None for what the `options` say; `key_every_s`
    is the time from one key frame to the next, None for the encoder's own choice.
    """

    codec: str = "libx264"
    options: Mapping[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv420p"
    bits_per_pixel: float | None = None
    key_every_s: float | None = None

    def set_up(self, stream: av.VideoStream, size: tuple[int, int], rate_hz: float) -> None:
        """Give a new stream of pictures of that width and height all that the encoder is told."""
        stream.width, stream.height = size
        stream.pix_fmt = self.pixel_format
        stream.options = dict(self.options)
        # With more threads, whose number goes by the machine, the encoder comes to other decisions.
        stream.codec_context.thread_count = 1
        if self.bits_per_pixel is not None:
            stream.bit_rate = round(self.bits_per_pixel * size[0] * size[1] * rate_hz)
        if self.key_every_s is not None:
            stream.codec_context.gop_size = max(1, round(self.key_every_s * rate_hz))


def constant_quality(crf: int) -> Encoding:
    """H.264 whose quantiser follows the picture, as good films are archived."""
    return Encoding(options={"crf": str(crf), "preset": "veryfast"})
