"""A message in the actions of a learned policy, in the terms of reinforcement-learning libraries; needs numpy alone."""

from mtm_onboard.policies.actionnoise import (
    KeyedActionNoise,
    VectorKeyedActionNoise,
    register_with_stable_baselines3,
)
from mtm_onboard.policies.bounds import ActionBounds
from mtm_onboard.policies.gaussian import KeyedGaussian
from mtm_onboard.policies.gymactions import add_to_actions
from mtm_onboard.policies.keyednoise import KeyedNoise
from mtm_onboard.policies.vectornoise import VectorKeyedNoise

__all__ = [
    "ActionBounds",
    "KeyedActionNoise",
    "KeyedGaussian",
    "KeyedNoise",
    "VectorKeyedActionNoise",
    "VectorKeyedNoise",
    "add_to_actions",
    "register_with_stable_baselines3",
]
