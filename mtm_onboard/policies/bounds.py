"""The bounds of an environment's actions, and how often they clip one."""

import numpy as np
from numpy.typing import ArrayLike

from mtm_onboard.policies.keyednoise import Floats
from mtm_onboard.protocol.errors import MtmError


class ActionBounds:
    """Keeps actions between `low` and `high`, each a number or one per component.

    `actions` counts all actions, `clipped` those of which at least one component was clipped: clipping removes noise
    and so weakens the message.
    """

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self.actions = self.clipped = 0
        self._low, self._high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        if not np.all(self._low <= self._high):
            raise MtmError("a lower bound of the actions is above its upper one; give low <= high")

    def clip(self, actions: Floats) -> Floats:
        """`actions`, (axes,) or (envs, axes), clipped to the bounds; raises MtmError when one is not finite."""
        if not np.all(np.isfinite(actions)):
            raise MtmError("an action is not finite and is not applied; check the inputs of the policy")
        within: Floats = np.clip(actions, self._low, self._high)
        cut = np.any(within != actions, axis=-1)
        self.actions += cut.size
        self.clipped += int(np.count_nonzero(cut))
        return within

    @property
    def clipped_share(self) -> float:
        """Share of the actions that were clipped, 0 before the first."""
        return self.clipped / self.actions if self.actions else 0.0
