"""Keyed noise with the interface of stable-baselines3's ActionNoise."""

import importlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.policies.keyednoise import KeyedNoise
from mtm_onboard.policies.vectornoise import VectorKeyedNoise
from mtm_onboard.protocol.errors import MtmError


class KeyedActionNoise:
    """sigma * eps of each step, with the channels' sigma: single precision, shape (axes,)."""

    def __init__(self, noise: KeyedNoise) -> None:
        self.noise: KeyedNoise | VectorKeyedNoise = noise

    def __call__(self) -> NDArray[np.float32]:
        """The noise to add to this step's action."""
        return (self.noise.sigma * self.noise()).astype(np.float32)

    def reset(self) -> None:
        """Does nothing: the message goes on beyond the end of an episode."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sigma={self.noise.sigma.tolist()})"


class VectorKeyedActionNoise(KeyedActionNoise):
    """sigma * eps of each step of several environments: single precision, shape (envs, axes)."""

    def __init__(self, noise: VectorKeyedNoise) -> None:
        self.noise = noise

    def reset(self, indices: Iterable[int] | None = None) -> None:
        """Does nothing: the messages go on beyond the end of an episode."""


def register_with_stable_baselines3() -> None:
    """Have stable-baselines3 take these classes for its own ActionNoise and VectorizedActionNoise.

    Otherwise it wraps copies of one noise for several environments. Raises MtmError when it is not installed.
    """
    try:
        noise = importlib.import_module("stable_baselines3.common.noise")
    except ImportError as error:
        raise MtmError("stable-baselines3 is not installed; install it with pip install stable-baselines3") from error
    noise.ActionNoise.register(KeyedActionNoise)
    noise.VectorizedActionNoise.register(VectorKeyedActionNoise)
