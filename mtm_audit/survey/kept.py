"""All times of a film, and some of its pictures."""

from collections.abc import Callable, Iterable

import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.tracking.gather import steady
from mtm_onboard.protocol.errors import MtmError

MOST_KEPT = 8


def kept_frames(
    frames: Iterable[Frame], progress: Callable[[int], None] | None = None
) -> tuple[Floats, tuple[Frame, ...]]:
    """The instants of all frames, and up to eight frames, the first among them and evenly spread however many come.

    Raises MtmError when there is no frame, and when the size of the picture changes.
    """
    times_s: list[float] = []
    kept: list[Frame] = []
    every = 1
    for number, frame in enumerate(steady(frames, progress)):
        times_s.append(frame.time_s)
        if number % every == 0:
            kept.append(Frame(frame.time_s, frame.image.copy()))
            if len(kept) > MOST_KEPT:
                kept, every = kept[::2], 2 * every
    if not kept:
        raise MtmError("the recording holds no picture; record it anew")
    return np.array(times_s), tuple(kept)
