"""A linear vehicle: gain, delay, first-order lag and oscillator of one axis, and what is known of such beforehand."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.plants.responses import Chain, Delay, Floats, Gain, Response, lag, oscillator

Complexes = NDArray[np.complex128]

# Ranges that `draw_response` draws from: delay in s, natural frequency in Hz, damping ratio, gain.
DELAYS_S, NATURALS_HZ, DAMPINGS, GAINS = (0.05, 0.3), (1.0, 6.0), (0.5, 1.0), (0.67, 1.2)


@dataclass(frozen=True, kw_only=True)
class LinearResponse:
    """How one axis follows its demand: `gain` at rest, a delay, a lag where `lag_s` is above zero, and an oscillator
    where `natural_hz` is given.
    """

    gain: float = 1.0
    delay_s: float = 0.0
    lag_s: float = 0.0
    natural_hz: float | None = None
    damping: float = 0.7

    def respond(self, step_s: float) -> Response:
        """The response at rest; its delay is rounded to whole steps."""
        stages: list[Response] = [Gain(self.gain), Delay(step_s, self.delay_s)]
        if self.lag_s > 0.0:
            stages.append(lag(step_s, self.lag_s))
        if self.natural_hz is not None:
            stages.append(oscillator(step_s, self.natural_hz, self.damping))
        return Chain(*stages)

    def followed(self, demand: Floats, step_s: float) -> Floats:
        """What becomes of the demand (n,) from rest, (n,)."""
        return self.respond(step_s).advance(demand[:, None])[:, 0]

    def at(self, frequencies_hz: Floats) -> Complexes:
        """The complex response at those frequencies, its delay not rounded."""
        laplace = 2j * np.pi * np.asarray(frequencies_hz)
        response = self.gain * np.exp(-self.delay_s * laplace) / (1.0 + self.lag_s * laplace)
        if self.natural_hz is not None:
            turn = 2.0 * np.pi * self.natural_hz
            response = response * turn**2 / (laplace**2 + 2.0 * self.damping * turn * laplace + turn**2)
        return np.asarray(response)


def draw_response(draw: np.random.Generator) -> LinearResponse:
    """A delay and an oscillator from the prior: delay and damping uniform, frequency and gain uniform in their logs."""
    return LinearResponse(
        delay_s=float(draw.uniform(*DELAYS_S)),
        natural_hz=float(np.exp(draw.uniform(*np.log(NATURALS_HZ)))),
        damping=float(draw.uniform(*DAMPINGS)),
        gain=float(np.exp(draw.uniform(*np.log(GAINS)))),
    )
