"""How robots follow a demanded velocity: stages that are put behind one another.

Each stage begins at rest and keeps its state, so that a run may be passed through it whole or step by step with the
same result. `advance` takes the demand (n, axes) of the next n steps and returns what is followed, (n, axes).

scipy.signal, which takes half a second to import, is imported where a linear filter is used: most robots have none.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Response(Protocol):
    """One stage, or several."""

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        ...


class Chain:
    """Stages one behind the other."""

    def __init__(self, *stages: Response) -> None:
        self._stages = stages

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        for stage in self._stages:
            demand = stage.advance(demand)
        return demand


class PerAxis:
    """A response of its own for each axis, in order."""

    def __init__(self, responses: Sequence[Response]) -> None:
        self._responses = responses

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        columns = [own.advance(demand[:, axis : axis + 1]) for axis, own in enumerate(self._responses)]
        return np.concatenate(columns, axis=1)


class Gain:
    """The demand times a factor."""

    def __init__(self, gain: float) -> None:
        self._gain = gain

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        return self._gain * demand


class Delay:
    """A pure delay of whole steps."""

    def __init__(self, step_s: float, delay_s: float) -> None:
        self._steps = round(delay_s / step_s)
        self._waiting: Floats | None = None

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        waiting = np.zeros((self._steps, demand.shape[1])) if self._waiting is None else self._waiting
        queue = np.concatenate([waiting, demand])
        self._waiting = queue[len(demand) :]
        return queue[: len(demand)]


class Filter:
    """A linear filter, the same for all axes."""

    def __init__(self, numerator: Floats, denominator: Floats) -> None:
        self._coefficients = numerator, denominator
        self._state: Floats | None = None

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        from scipy import signal

        numerator, denominator = self._coefficients
        order = max(len(numerator), len(denominator)) - 1
        state = np.zeros((order, demand.shape[1])) if self._state is None else self._state
        result, self._state = signal.lfilter(numerator, denominator, demand, axis=0, zi=state)
        return np.asarray(result)


def lag(step_s: float, lag_s: float) -> Filter:
    """A first-order lag."""
    keep = np.exp(-step_s / lag_s)
    return Filter(np.array([1.0 - keep]), np.array([1.0, -keep]))


def oscillator(step_s: float, natural_hz: float, damping: float) -> Filter:
    """An oscillator of that natural frequency and damping ratio, as a multicopter's attitude loop gives."""
    from scipy import signal

    turn = 2.0 * np.pi * natural_hz
    return Filter(*signal.bilinear([turn**2], [1.0, 2.0 * damping * turn, turn**2], 1.0 / step_s))


def notch(step_s: float, notch_hz: float, quality: float) -> Filter:
    """A notch filter, as it is put into a command path against a resonance of the structure."""
    from scipy import signal

    return Filter(*signal.iirnotch(notch_hz, quality, fs=1.0 / step_s))


class Saturation:
    """A gain of one for small demands that bends towards `limit` as a hyperbolic tangent."""

    def __init__(self, limit: float) -> None:
        self._limit = limit

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        return np.asarray(self._limit * np.tanh(demand / self._limit))


class Friction:
    """Static friction: the robot stands while the demand's first two axes together are below `least`."""

    def __init__(self, least: float) -> None:
        self._least = least

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        moves = np.hypot(demand[:, 0], demand[:, 1]) >= self._least
        return np.where(moves[:, None], demand, 0.0)


class SlewLimit:
    """The nearest velocity that changes no faster than `most_per_s`."""

    def __init__(self, step_s: float, most_per_s: float) -> None:
        self._most = most_per_s * step_s
        self._velocities: list[float] = []

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        most, result = self._most, np.empty_like(demand)
        velocities = self._velocities or [0.0] * demand.shape[1]
        for axis, column in enumerate(demand.T.tolist()):
            velocity = velocities[axis]
            for row, wanted in enumerate(column):
                velocity += min(most, max(-most, wanted - velocity))
                result[row, axis] = velocity
            velocities[axis] = velocity
        self._velocities = velocities
        return result


class Backlash:
    """Play of gears, a distance or an angle: the output stands until the input has crossed it, and is then pushed."""

    def __init__(self, step_s: float, play: float) -> None:
        self._step_s, self._half = step_s, 0.5 * play
        self._input: Floats | None = None
        self._output: list[float] = []

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        axes = demand.shape[1]
        before = np.zeros(axes) if self._input is None else self._input
        travelled = before + np.cumsum(demand, axis=0) * self._step_s
        half, places, result = self._half, self._output or [0.0] * axes, np.empty((len(demand) + 1, axes))
        result[0] = places
        for axis, column in enumerate(travelled.T.tolist()):
            place = places[axis]
            for row, pushed in enumerate(column, 1):
                place = min(pushed + half, max(pushed - half, place))
                result[row, axis] = place
            places[axis] = place
        self._input, self._output = travelled[-1], places
        return np.diff(result, axis=0) / self._step_s
