"""One picture of a video and when it was taken."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Pixels = Literal["gray", "bgr"]


@dataclass(frozen=True)
class Frame:
    """A picture, `image` (height, width) gray or (height, width, 3) in the order blue, green, red, at `time_s`."""

    time_s: float
    image: Image

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.image.shape[1], self.image.shape[0]
