"""White Gaussian noise on top of the commands (the paper's table tab:adv-additive)."""

from collections.abc import Mapping

import numpy as np

from hil.experiments.attacks.attack import Attack, PaperFigure
from hil.experiments.attacks.driving import CHANCE_PERCENT, SIGMA_MPS, suppressed
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

ARM = "white noise"
_PAPER = {
    0.0: (100.0, 0.132), 0.33: (100.0, 0.126), 0.83: (98.5, 0.090), 1.67: (69.3, 0.041), 3.33: (21.5, 0.027),
    5.0: (17.0, 0.023), 6.67: (14.8, 0.024),
}  # fmt: skip


def with_white_noise(sigma_mps: float, draw: np.random.Generator) -> Tamper:
    """Adds white noise of that standard deviation."""

    def tamper(tick: Tick) -> Floats:
        noisy: Floats = tick.requested_mps + sigma_mps * draw.standard_normal(tick.requested_mps.shape)
        return noisy

    return tamper


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    return suppressed(lambda count, draw: with_white_noise(level * SIGMA_MPS, draw), rollouts, seed)


ATTACK = Attack(
    name="additive_noise", level="attacker's noise over the watermark's", counted="messages right",
    levels={ARM: tuple(_PAPER)}, measure=_measure, chance_percent=CHANCE_PERCENT, share=1.0, batch=25,
    paper={(ARM, level): PaperFigure("tab:adv-additive", *figures) for level, figures in _PAPER.items()},
)  # fmt: skip
