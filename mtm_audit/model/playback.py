"""At which times the pictures of a film were taken, where the file is not to be believed."""

import math
from dataclasses import dataclass

from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Playback:
    """`frame_rate_hz` replaces the file's times by even ones; a film played `speed` times as fast shows real time.

    Slow motion taken at 120 and shown at 30 frames a second has the speed 4, time lapse one below 1. Raises MtmError
    when either is not a positive number.
    """

    frame_rate_hz: float | None = None
    speed: float = 1.0

    def __post_init__(self) -> None:
        if self.frame_rate_hz is not None and not (math.isfinite(self.frame_rate_hz) and self.frame_rate_hz > 0.0):
            raise MtmError(f"a film of {self.frame_rate_hz} frames a second cannot be; give a number above zero")
        if not (math.isfinite(self.speed) and self.speed > 0.0):
            raise MtmError(f"a film cannot be played {self.speed} times as fast; give a number above zero")
