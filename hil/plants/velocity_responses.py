"""How vehicles follow a demanded velocity, over a whole run at once.

All functions take `demand` (n, axes) at a fixed step, begin at rest, and return what is followed, (n, axes).
"""

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Floats = NDArray[np.float64]


def delayed(demand: Floats, step_s: float, delay_s: float) -> Floats:
    """A pure delay of whole steps."""
    steps = round(delay_s / step_s)
    return np.concatenate([np.zeros((steps, demand.shape[1])), demand])[: len(demand)]


def lagged(demand: Floats, step_s: float, lag_s: float) -> Floats:
    """A first-order lag."""
    keep = np.exp(-step_s / lag_s)
    return np.asarray(signal.lfilter([1.0 - keep], [1.0, -keep], demand, axis=0))


def second_order(demand: Floats, step_s: float, natural_hz: float, damping: float) -> Floats:
    """An oscillator of that natural frequency and damping ratio, as a multicopter's attitude loop gives."""
    turn = 2.0 * np.pi * natural_hz
    numerator, denominator = signal.bilinear([turn**2], [1.0, 2.0 * damping * turn, turn**2], 1.0 / step_s)
    return np.asarray(signal.lfilter(numerator, denominator, demand, axis=0))


def notched(demand: Floats, step_s: float, notch_hz: float, quality: float) -> Floats:
    """A notch filter, as it is put into a command path against a resonance of the structure."""
    numerator, denominator = signal.iirnotch(notch_hz, quality, fs=1.0 / step_s)
    return np.asarray(signal.lfilter(numerator, denominator, demand, axis=0))


def saturated(demand: Floats, limit: float) -> Floats:
    """A gain of one for small demands that bends towards `limit` as a hyperbolic tangent."""
    return np.asarray(limit * np.tanh(demand / limit))


def sticking(demand: Floats, least: float) -> Floats:
    """Static friction: the vehicle stands while the demand's first two axes together are below `least`."""
    moves = np.hypot(demand[:, 0], demand[:, 1]) >= least
    return np.where(moves[:, None], demand, 0.0)


def slew_limited(demand: Floats, step_s: float, most_per_s: float) -> Floats:
    """The nearest velocity that changes no faster than `most_per_s`."""
    most = most_per_s * step_s
    result = np.empty_like(demand)
    for axis, column in enumerate(demand.T.tolist()):
        velocity = 0.0
        for row, wanted in enumerate(column):
            velocity += min(most, max(-most, wanted - velocity))
            result[row, axis] = velocity
    return result


def with_play(demand: Floats, step_s: float, play: float) -> Floats:
    """Backlash of gears: the output stands until the input has crossed `play`, a distance, and is then pushed."""
    half = 0.5 * play
    travelled = np.cumsum(demand, axis=0) * step_s
    result = np.empty_like(travelled)
    for axis, column in enumerate(travelled.T.tolist()):
        place = 0.0
        for row, pushed in enumerate(column):
            place = min(pushed + half, max(pushed - half, place))
            result[row, axis] = place
    return np.diff(result, axis=0, prepend=0.0) / step_s
