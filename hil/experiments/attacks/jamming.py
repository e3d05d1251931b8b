"""Structured jamming: a small learned network foretells the noise from motion and subtracts it, more or less of it.

Its input is what the paper names: the current observation and the recent motion. One layer of fixed random tanh units
is followed by weights that are fitted on rollouts the attacker overheard, and was told the noise of, which is more than
the paper grants. The level is how much of what it foretells is subtracted.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from hil.experiments.attacks.attack import FORETOLD, Attack
from hil.experiments.attacks.driving import CHANCE_PERCENT, SIGMA_MPS, TRACKER_ERROR_M, overheard, suppressed
from hil.experiments.attacks.foretelling import share_foretold
from hil.experiments.attacks.network import Network
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

EXACT, FILMED = "from exact motion", "from filmed motion"
_LEVELS = (0.0, 0.5, 1.0, 2.0, 4.0)
_MEMORY = 20
_TICK_S = 0.1


@lru_cache(maxsize=2)
def learnt_network(source: str) -> Network:
    """The network, fitted to overheard rollouts."""
    noise, exact_m, filmed_m = overheard()
    positions_m = exact_m if source == EXACT else filmed_m
    steps = np.diff(positions_m, axis=1, prepend=positions_m[:, :1]) / _TICK_S
    ticks = steps.shape[1]
    windows = [
        steps[:, first - _MEMORY : first][:, ::-1].reshape(len(steps), -1) for first in range(_MEMORY, ticks + 1)
    ]
    inputs = np.stack(windows, axis=1)
    return Network(inputs.reshape(-1, 2 * _MEMORY), noise[:, _MEMORY - 1 :].reshape(-1, 2))


class Jammer:
    """Subtracts `gain` times what the network foretells."""

    def __init__(self, network: Network, gain: float, source: str, rollouts: int, draw: np.random.Generator) -> None:
        self._network, self._gain, self._source, self._draw = network, gain, source, draw
        self._steps = np.zeros((rollouts, _MEMORY, 2))
        self._before_m: Floats | None = None
        self.there: list[Floats] = []
        self.foretold: list[Floats] = []

    def __call__(self, tick: Tick) -> Floats:
        """What is left of the command."""
        seen_m = tick.positions_m
        if self._source == FILMED:
            seen_m = seen_m + TRACKER_ERROR_M * self._draw.standard_normal(seen_m.shape)
        self._steps[:, 1:] = self._steps[:, :-1].copy()
        self._steps[:, 0] = 0.0 if self._before_m is None else (seen_m - self._before_m) / _TICK_S
        self._before_m = seen_m
        # No command is larger than the noise can be.
        guess = np.clip(self._network(self._steps.reshape(len(self._steps), -1)), -3.0 * SIGMA_MPS, 3.0 * SIGMA_MPS)
        self.there.append(tick.requested_mps - tick.base_mps)
        self.foretold.append(guess)
        left: Floats = tick.requested_mps - self._gain * guess
        return left

    @property
    def share(self) -> float:
        """R2 of what was foretold."""
        return share_foretold(np.array(self.there), np.array(self.foretold))


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    made: list[Jammer] = []

    def make(count: int, draw: np.random.Generator) -> Tamper:
        made.append(Jammer(learnt_network(arm), level, arm, count, draw))
        return made[0]

    return {**suppressed(make, rollouts, seed), FORETOLD: made[0].share}


ATTACK = Attack(
    name="jamming", level="how much of what is foretold is subtracted", counted="messages right",
    levels=dict.fromkeys((EXACT, FILMED), _LEVELS), measure=_measure, chance_percent=CHANCE_PERCENT,
)  # fmt: skip
