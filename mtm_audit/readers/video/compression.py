"""How coarsely a video file is coded, from its packets and the quantisers in them."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from mtm_audit.model.compression import Compression
from mtm_audit.readers.video.opened import decoding_errors, opened_video

if TYPE_CHECKING:
    from av import VideoFrame
    from av.sidedata.encparams import VideoEncParams
    from av.sidedata.sidedata import SideData

# Pictures whose quantisers are looked at; what follows is coded alike.
_PICTURES = 20
# Number of the kind of picture that needs no other, in the library.
_INTRA = 1


def read_compression(path: Path) -> Compression | None:
    """Codec, bits and quantiser of a film; None when it holds no packet. Raises MtmError as `read_frames` does."""
    size_bits = packets = 0
    quantisers: list[float] = []
    with opened_video(path) as (container, stream):
        context = stream.codec_context
        codec, pixels = context.name, stream.width * stream.height
        context.options = {"export_side_data": "venc_params"}
        # Where a film is damaged, what came before tells enough.
        with suppress(*decoding_errors()):
            for packet in container.demux(stream):
                size_bits += 8 * packet.size
                packets += packet.size > 0
                if codec == "h264" and packets <= _PICTURES:
                    quantisers += [found for picture in packet.decode() for found in _quantiser(picture)]
    if not packets or not pixels:
        return None
    return Compression(codec, size_bits / packets / pixels, float(np.mean(quantisers)) if quantisers else None)


def _quantiser(picture: "VideoFrame") -> list[float]:
    """The mean over a picture that was coded as a change of others; nothing of any other picture."""
    from av.sidedata.sidedata import Type

    beside = cast("Mapping[Type, SideData]", picture.side_data)
    stated = beside.get(Type.VIDEO_ENC_PARAMS)
    if stated is None or int(picture.pict_type) == _INTRA:
        return []
    return [float(np.mean(cast("VideoEncParams", stated).qp_map()))]
