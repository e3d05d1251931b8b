"""The keyed noise of several environments that step together."""

from collections.abc import Sequence

import numpy as np

from mtm_onboard.policies.keyednoise import Floats, KeyedNoise
from mtm_onboard.protocol.errors import MtmError


class VectorKeyedNoise:
    """Unit-variance noise of shape (envs, axes), one step of all environments a call.

    Each environment has its own noise, and so its own key, channel, message and phase. Raises MtmError when they differ
    in size or share a modulator, which plays for one tick at a time.
    """

    def __init__(self, noises: Sequence[KeyedNoise]) -> None:
        if len({len(noise.axes) for noise in noises}) != 1:
            raise MtmError("the environments' actions differ in size; give one noise or more with as many axes each")
        modulators = [id(modulator) for noise in noises for modulator in noise.modulators]
        if len(set(modulators)) != len(modulators):
            raise MtmError("two environments share a modulator; make one for each")
        self.noises = tuple(noises)
        self.sigma: Floats = np.stack([noise.sigma for noise in noises])

    def __call__(self) -> Floats:
        """The noise of this step, (envs, axes)."""
        return np.stack([noise() for noise in self.noises])
