"""What moves robots beside their commands. Each source goes on where its last `advance` ended.

`advance(count)` returns velocities (count, axes) for the next steps.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hil.plants.responses import Filter, Floats


class Interference(Protocol):
    """A source of velocity noise."""

    def advance(self, count: int) -> Floats:
        """The noise of the next steps."""
        ...


class Slip:
    """Noise of one standard deviation an axis whose correlation falls exponentially, stationary."""

    def __init__(
        self, step_s: float, deviations: Sequence[float], correlation_s: float, draw: np.random.Generator
    ) -> None:
        self._draw, self._deviations = draw, np.asarray(deviations)
        self._keep = float(np.exp(-step_s / correlation_s))
        self._filter = Filter(np.array([1.0]), np.array([1.0, -self._keep]))
        self._begun = False

    def advance(self, count: int) -> Floats:
        """The noise of the next steps."""
        first = 1.0 / np.sqrt(1.0 - self._keep**2)
        kicks = self._draw.standard_normal((count, len(self._deviations))) / first
        if not self._begun and count:
            self._begun = True
            kicks[0] *= first
        return self._deviations * self._filter.advance(kicks)


def slip_density(deviation: float, correlation_s: float, frequencies_hz: Floats) -> Floats:
    """One-sided power density of such noise, in the square of its unit over Hz, shape as the frequencies."""
    density = 4.0 * correlation_s * deviation**2 / (1.0 + (2.0 * np.pi * frequencies_hz * correlation_s) ** 2)
    return np.asarray(density)


class Gait:
    """Body sway of a walking robot: the stride and its second harmonic, whose pace and strength wander."""

    def __init__(self, step_s: float, stride_hz: float, speed_mps: float, draw: np.random.Generator) -> None:
        self._step_s, self._stride_hz, self._speed_mps = step_s, stride_hz, speed_mps
        self._phase = float(draw.uniform(0.0, 2.0 * np.pi))
        self._offsets = draw.uniform(0.0, 2.0 * np.pi, 3)
        self._pace = Slip(step_s, (0.03,), 1.0, draw)
        self._strength = Slip(step_s, (0.15, 0.15, 0.15), 1.0, draw)

    def advance(self, count: int) -> Floats:
        """The noise of the next steps, (count, 3)."""
        pace = self._stride_hz * (1.0 + self._pace.advance(count)[:, 0])
        phase = self._phase + 2.0 * np.pi * np.cumsum(pace) * self._step_s
        self._phase = float(phase[-1])
        sway = np.stack([
            np.cos(2.0 * phase + self._offsets[0]),
            np.cos(phase + self._offsets[1]) + 0.3 * np.cos(3.0 * phase),
            0.5 * np.cos(phase + self._offsets[2]),
        ], axis=1)  # fmt: skip
        return np.asarray(self._speed_mps * (1.0 + self._strength.advance(count)) * sway)


class Sum:
    """Several sources together."""

    def __init__(self, *sources: Interference) -> None:
        self._sources = sources

    def advance(self, count: int) -> Floats:
        """The noise of the next steps."""
        return np.asarray(np.sum([source.advance(count) for source in self._sources], axis=0))
