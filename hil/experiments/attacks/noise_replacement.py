"""Fresh noise in the place of the keyed one, by somebody who knows the policy and so where the noise begins.

This costs the task nothing: the commands are distributed as they were. The level is the share of the noise's power
that is replaced.
"""

from collections.abc import Mapping

import numpy as np

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.driving import CHANCE_PERCENT, SIGMA_MPS, TICKS, band_noise, suppressed
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

SAME_BAND, WHITE = "with noise of the same band", "with white noise"
_LEVELS = (0.0, 0.5, 0.75, 0.9, 0.95, 0.98, 1.0)


def replacing(share: float, fresh: Floats) -> Tamper:
    """Puts `fresh` noise (ticks, rollouts, 2) in the place of that share of the noise's power."""

    def tamper(tick: Tick) -> Floats:
        kept = np.sqrt(1.0 - share) * (tick.requested_mps - tick.base_mps)
        replaced: Floats = tick.base_mps + kept + np.sqrt(share) * fresh[tick.number]
        return replaced

    return tamper


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    def make(count: int, draw: np.random.Generator) -> Tamper:
        shape = count, TICKS, 2
        fresh = band_noise(shape, draw) if arm == SAME_BAND else SIGMA_MPS * draw.standard_normal(shape)
        return replacing(level, fresh.transpose(1, 0, 2))

    return suppressed(make, rollouts, seed)


ATTACK = Attack(
    name="noise_replacement", level="share of the noise's power replaced", counted="messages right",
    levels=dict.fromkeys((SAME_BAND, WHITE), _LEVELS), measure=_measure, chance_percent=CHANCE_PERCENT,
)  # fmt: skip
