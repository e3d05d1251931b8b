"""A few of many, evenly spread."""

import numpy as np


def spread_evenly(count: int, most: int) -> tuple[int, ...]:
    """Up to `most` of the numbers 0 to `count` - 1, evenly spread and without the very ends where there is room."""
    chosen = (np.arange(min(most, count)) + 0.5) * count / max(min(most, count), 1)
    return tuple(int(number) for number in chosen)
