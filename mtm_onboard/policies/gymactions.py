"""A Gymnasium environment that adds the message's noise to its actions."""

from functools import cache
from typing import Any

import numpy as np

from mtm_onboard.policies.bounds import ActionBounds
from mtm_onboard.policies.keyednoise import KeyedNoise
from mtm_onboard.protocol.errors import MtmError


def add_to_actions(env: Any, noise: KeyedNoise) -> Any:
    """`env` in a gymnasium.ActionWrapper that adds sigma * eps to each action and clips it to the action space.

    For policies that are deterministic. The wrapper has the `noise` and the `bounds`, an ActionBounds, which counts
    what was clipped; a reset of the environment leaves the message's phase as it is. Raises MtmError when Gymnasium is
    not installed and when the actions are not vectors with one number for each of the noise's axes.
    """
    return _wrapper()(env, noise)


@cache
def _wrapper() -> Any:
    try:
        import gymnasium
    except ImportError as error:
        raise MtmError("Gymnasium is not installed; install it with pip install gymnasium") from error

    class MessageInActions(gymnasium.ActionWrapper[Any, Any, Any]):
        """Adds the keyed noise to actions."""

        def __init__(self, env: Any, noise: KeyedNoise) -> None:
            super().__init__(env)
            space = env.action_space
            if not isinstance(space, gymnasium.spaces.Box) or space.shape != (len(noise.axes),):
                raise MtmError(
                    f"the environment's actions are {space}, but the noise has the axes {', '.join(noise.axes)}; "
                    "name the action's components as the noise's axes"
                )
            self.noise = noise
            self.bounds = ActionBounds(space.low, space.high)
            self._dtype = space.dtype

        def action(self, action: Any) -> Any:
            """`action` with the noise of this step, within the action space."""
            noisy = np.asarray(action, dtype=np.float64) + self.noise.sigma * self.noise()
            return self.bounds.clip(noisy).astype(self._dtype)

    return MessageInActions
