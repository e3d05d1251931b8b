"""The keyed noise of one policy: the eps of each step's action."""

from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.modulator import Modulator

Floats = NDArray[np.float64]


class KeyedNoise:
    """The unit-variance noise of each step's action, shape (axes,); one call is one step.

    Each of `modulators` plays one channel. `axes` name the action's components in order, by default the channels' own.
    Where no message is being sent, on components that no channel has and in silence, the noise is `random`'s, or zero
    when that is None: a stochastic policy needs it there as well, a deterministic one needs none.

    `tick` says which tick a call is in. None counts the calls, which is right in a simulation, where a step is a tick;
    a robot's ticks come from elapsed time, so that a late step shifts nothing. The end of an episode is not the end of
    the message, and nothing here is reset by it. A copy or pickle has no key, as a saved model must not, and raises
    MtmError when called. Raises MtmError when the axes do not fit the channels.
    """

    def __init__(
        self,
        modulators: Sequence[Modulator],
        axes: Sequence[str] | None = None,
        *,
        tick: Callable[[], int] | None = None,
        random: np.random.Generator | None = None,
    ) -> None:
        played = [axis for modulator in modulators for axis in modulator.channel.axes]
        self.axes = tuple(played if axes is None else axes)
        _check_axes(played, self.axes)
        places = [[self.axes.index(axis) for axis in modulator.channel.axes] for modulator in modulators]
        self.modulators = tuple(modulators)
        self.random = random
        self.sigma = np.zeros(len(self.axes))
        for modulator, own in zip(modulators, places, strict=True):
            self.sigma[own] = modulator.channel.sigmas
        self._places = places
        self._tick = count().__next__ if tick is None else tick

    def __call__(self) -> Floats:
        """The noise of this step, (axes,). Once a window it computes ahead for some milliseconds."""
        if not self.modulators:
            raise MtmError(
                "this noise is a copy, and a copy has no key; make a KeyedNoise for each model that is loaded and one "
                "for each environment"
            )
        tick, size = self._tick(), len(self.axes)
        noise: Floats = np.zeros(size) if self.random is None else self.random.standard_normal(size)
        for modulator, places in zip(self.modulators, self._places, strict=True):
            if modulator.sends(tick):
                noise[places] = modulator.perturbation(tick)
            modulator.prepare(tick)
        return noise

    def __getstate__(self) -> dict[str, Any]:
        return {"axes": self.axes, "sigma": self.sigma, "modulators": ()}


def _check_axes(played: Sequence[str], axes: Sequence[str]) -> None:
    if not played:
        raise MtmError("there is no channel to play; give one modulator or more")
    for names, whose in ((played, "the channels"), (axes, "the action")):
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise MtmError(f"{whose} have the axis {repeated[0]!r} twice; name each axis once")
    missing = sorted(set(played) - set(axes))
    if missing:
        raise MtmError(f"the action has no component {missing[0]!r} that a channel has; name it among the axes")
