"""The spectrum of the noise: how its power is shared out over the tones of a window.

It is given by a few points, each a frequency in hertz and a level in decibels. Between two points the level follows the
straight line over frequency, and outside them it is that of the nearest. Only differences of levels count, since the
power of all tones together stays what it is without a spectrum:

    w_k = |K| 10^(L_k / 10) / sum over j in K of 10^(L_j / 10),    L_k the level at k * rate_hz / n
"""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError

Points = tuple[tuple[float, float], ...]
Floats = NDArray[np.float64]

MAX_POINTS = 64
# A tone that is fainter by more is better left out of the band.
MAX_RANGE_DB = 60.0
_MAX_HZ = 1e6


def tone_powers(points: Points, tones_hz: Floats) -> Floats:
    """Power w_k of each tone beside that of an even share, (K,): positive and of mean 1."""
    frequencies_hz, levels_db = np.array(points, dtype=np.float64).T
    levels = np.interp(tones_hz, frequencies_hz, levels_db)
    powers = 10.0 ** ((levels - levels.max()) / 10.0)
    shares: Floats = powers * (len(powers) / powers.sum())
    return shares


def points_from_table(value: object) -> Points:
    """The points of a parsed TOML array [[Hz, dB], ...]; raises MtmError for what is none."""
    if not isinstance(value, list) or not all(isinstance(point, list) and len(point) == 2 for point in value):
        raise MtmError("the scheme's spectrum must be a list of points [Hz, dB], such as [[0.5, 0.0], [5.0, -6.0]]")
    return tuple((point[0], point[1]) for point in value)


def check_points(points: object) -> None:
    """Raise MtmError, with one sentence that says what to change, for points that give no spectrum."""
    if not isinstance(points, tuple) or not all(isinstance(point, tuple) and len(point) == 2 for point in points):
        raise MtmError("the spectrum must be points, each a frequency in Hz and a level in dB")
    if not 2 <= len(points) <= MAX_POINTS:
        raise MtmError(
            f"the spectrum has {len(points)} points; give 2 to {MAX_POINTS}, or none at all for a flat spectrum"
        )
    for value in (number for point in points for number in point):
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise MtmError(f"the spectrum holds {value!r}; give numbers alone, Hz and dB of each point")
    frequencies_hz, levels_db = [hz for hz, _ in points], [level_db for _, level_db in points]
    if any(later <= earlier for earlier, later in pairwise(frequencies_hz)):
        raise MtmError("the spectrum's frequencies do not rise from point to point; put the lowest first, each once")
    if frequencies_hz[0] < 0.0 or frequencies_hz[-1] > _MAX_HZ:
        raise MtmError(f"the spectrum's frequencies must lie between 0 and {_MAX_HZ:g} Hz; correct the points")
    if max(levels_db) - min(levels_db) > MAX_RANGE_DB:
        raise MtmError(
            f"the spectrum's levels span {max(levels_db) - min(levels_db):g} dB; {MAX_RANGE_DB:g} dB at most, and what "
            "should carry nothing is better left out of the band"
        )
